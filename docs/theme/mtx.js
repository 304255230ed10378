// Highlights .mtx in the book. Words and tokens are those of grammar/mtx.pest.
(function () {
    "use strict";

    function language(hljs) {
        const items =
            "use dimension unit species solution reaction reactive_group material incompatible allow hazard caution capability " +
            "asset process event relation extern fn const driver lab skill workflow study fit test";
        const members =
            "param state derived reading flow extensive part view command frame keeps ends joint solid include between holding " +
            "labelled symmetric pitch over vary runs report estimate match data";
        const clauses =
            "needs presumes ever effect takes fails option says moves grips frees leads because sends asks expects answers alive " +
            "reply when where per point also prefixes";
        const steps =
            "let wait until timeout step if else repeat while max times for within after hold keep try retry claim sequence " +
            "parallel start await fail expect record every note ask return finally is of and or not";
        const comment = hljs.COMMENT("//", "$");
        const text = {
            className: "string",
            begin: '"',
            end: '"',
            illegal: "\\n",
            contains: [
                { begin: /\\.|\{\{|\}\}/ },
                { className: "subst", begin: /\{/, end: /\}/ },
            ],
        };
        const letter = "[A-Za-zµμ°ΩÅ%_]";
        const more = "[A-Za-z0-9µμ°ΩÅ%_]";
        const unit = "(?:1/)?" + letter + more + "*(?:[/*^](?:\\([^)\\s]*\\)|-?" + more + "+))*";
        return {
            name: "mtx",
            keywords: {
                $pattern: /[A-Za-z_][A-Za-z0-9_]*/,
                keyword: [items, members, clauses, steps, "mtx in any"].join(" "),
                built_in: "to from into onto on with by at using through as",
                literal: "true false nothing unlimited elapsed open closed",
            },
            contains: [
                comment,
                text,
                {
                    className: "number",
                    begin: new RegExp(
                        "\\b\\d+(?:\\.\\d+)?(?:[eE][+-]?\\d+)?(?: ?(?!(?:to|from|into|onto|on|in|with|by|at|using|through|as|of|and|or|is|" +
                            "times|timeout|max|every|for|after|else|log|noise|pitch|labelled|per)\\b)" +
                            unit +
                            ")?"
                    ),
                },
                { className: "type", begin: /\b[A-Z][A-Za-z0-9_]*(?:\^?\d*[+-])?/ },
                { className: "attr", begin: /\b[a-z_][A-Za-z0-9_]*(?=:(?!:))/ },
                { className: "symbol", begin: /->|<->|<-|\.\.|\+-|[+\-]=|==|!=|<=|>=/ },
            ],
        };
    }

    if (typeof hljs === "undefined") return;
    hljs.registerLanguage("mtx", language);
    const blocks = document.querySelectorAll("code.language-mtx");
    for (const block of blocks) {
        if (hljs.highlightElement) {
            delete block.dataset.highlighted;
            block.textContent = block.textContent;
            hljs.highlightElement(block);
        } else {
            hljs.highlightBlock(block);
        }
    }
})();
