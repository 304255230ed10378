// What one token of lookahead cannot tell: whether a line goes on, where a unit ends, whether a word is part of a verb, and the charges of
// species. Keeps no state.
//
// The names and conditions are those of grammar/mtx.pest.
#include "tree_sitter/parser.h"

#include <string.h>

enum Token {
    NEWLINE, BLANK_LINE, NL_CLAUSE, NL_MORE,
    UNIT, UNIT_AFTER_AS, STATE_WORD, FIRST_WORD, NEXT_WORD, SPECIES, SPECIES_INDEX, SPECIES_ION, LESS,
    TIGHT, SAME_LINE, BESIDE, ERROR_SENTINEL,
};

// With these a line goes on, wherever they are no names of fields: nothing begins with them.
static const char GOES_ON[] =
    " to from into onto on in with by at using through as is and or while until timeout max after every else finally holding needs presumes"
    " fails effect takes sends asks expects ";

// With these a line goes on where they are expected.
static const char CLAUSES[] = " warns option says moves grips frees leads ";
static const char MORE[] = " straight driving upright tilted home about when because within also labelled pitch noise for over ";

static const char LABELS[] = " to from into onto on in with by at using through as ";

static const char RESERVED[] =
    " after and as ask asks at await by claim effect else every expect expects fail fails finally for from hold holding if in into is keep let"
    " needs not note of on onto or parallel presumes record repeat retry return sends sequence start step takes through timeout to try until"
    " using wait while with within ";

// With these a step may begin behind a closing brace on its line. `for` also stands in `hold c for 1 min`.
static const char STEPS[] =
    " let wait step if repeat for within hold keep try retry claim sequence parallel start await fail expect record note ask return ";

// Words after a number that are no units.
static const char NOT_UNITS[] = " log times pitch also noise labelled symmetric per prefixes where when over ";

// After the charge of an ion.
static const char AFTER_ION[] = " in is and or else timeout for max ";

// After a preposition that is the word of a state.
static const char AFTER_STATE_WORD[] = " and or else timeout for max ";

// Longer than any word that has a meaning.
#define MAX_WORD 24

typedef struct { char text[MAX_WORD + 3]; unsigned length; } Word;

static inline int32_t next(TSLexer *lexer) { return lexer->lookahead; }
static inline void advance(TSLexer *lexer) { lexer->advance(lexer, false); }
static inline bool is_digit(int32_t c) { return c >= '0' && c <= '9'; }
static inline bool is_letter(int32_t c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
static inline bool is_idc(int32_t c) { return is_letter(c) || is_digit(c) || c == '_'; }
static inline bool is_blank(int32_t c) { return c == ' ' || c == '\t' || c == '\r'; }

static bool accept(TSLexer *lexer, int32_t c) {
    if (next(lexer) != c) return false;
    advance(lexer);
    return true;
}

static bool found(TSLexer *lexer, enum Token token) {
    lexer->result_symbol = token;
    return true;
}

// Reads letters, digits and `_`; keeps them between blanks, to be looked for in a list.
static void read_word(TSLexer *lexer, Word *word) {
    word->length = 0;
    word->text[0] = ' ';
    while (is_idc(next(lexer))) {
        if (word->length < MAX_WORD) word->text[1 + word->length] = (char)next(lexer);
        word->length++;
        advance(lexer);
    }
    unsigned kept = word->length < MAX_WORD ? word->length : MAX_WORD;
    word->text[1 + kept] = ' ';
    word->text[2 + kept] = 0;
}

static bool is_one_of(const Word *word, const char *list) {
    return word->length > 0 && word->length < MAX_WORD && strstr(list, word->text) != NULL;
}

// `max` is a name where it is called.
static bool is_reserved(TSLexer *lexer, const Word *word) {
    return is_one_of(word, RESERVED) || (strcmp(word->text, " max ") == 0 && next(lexer) != '(');
}

// Skips blanks, line ends and comments. False where a `/` that begins no comment has been read.
static bool skip_space(TSLexer *lexer, bool lines) {
    for (;;) {
        if (is_blank(next(lexer)) || (lines && next(lexer) == '\n')) {
            advance(lexer);
        } else if (next(lexer) == '/') {
            advance(lexer);
            if (next(lexer) != '/') return false;
            while (next(lexer) != '\n' && !lexer->eof(lexer)) advance(lexer);
        } else {
            return true;
        }
    }
}

// ---- line ends

static bool line_end(TSLexer *lexer, bool goes_on) {
    return found(lexer, goes_on ? BLANK_LINE : NEWLINE);
}

// A run of line ends and blanks, and what it means before what follows.
static bool scan_line_end(TSLexer *lexer, const bool *valid) {
    while (next(lexer) == '\n' || is_blank(next(lexer))) advance(lexer);
    lexer->mark_end(lexer);
    bool recovering = valid[ERROR_SENTINEL];
    if (lexer->eof(lexer)) return found(lexer, valid[NEWLINE] && !recovering ? NEWLINE : BLANK_LINE);
    int32_t first = next(lexer);
    if (is_letter(first)) {
        Word word;
        read_word(lexer, &word);
        bool called = next(lexer) == '(';
        while (is_blank(next(lexer))) advance(lexer);
        if (accept(lexer, ':') && next(lexer) != ':') return found(lexer, NEWLINE);
        if (is_one_of(&word, GOES_ON)) return line_end(lexer, !(called && strcmp(word.text, " max ") == 0));
        if (!recovering && valid[NL_CLAUSE] && is_one_of(&word, CLAUSES)) return found(lexer, NL_CLAUSE);
        if (!recovering && valid[NL_MORE] && is_one_of(&word, MORE)) return found(lexer, NL_MORE);
        return found(lexer, NEWLINE);
    }
    advance(lexer);
    int32_t second = next(lexer);
    switch (first) {
        case '}': case ')': case ']': case ',': case '|': case '*': case '^': case '>': return found(lexer, BLANK_LINE);
        case '"': return found(lexer, valid[NL_MORE] && !recovering ? NL_MORE : NEWLINE);
        case '{': return found(lexer, valid[NL_CLAUSE] && !recovering ? NL_CLAUSE : NEWLINE);
        case '/': return found(lexer, BLANK_LINE);
        case '=':
            if (second == '=') return found(lexer, BLANK_LINE);
            return found(lexer, valid[NL_MORE] && !recovering ? NL_MORE : NEWLINE);
        case '!': return line_end(lexer, second == '=');
        case '+': case '-': return line_end(lexer, second != '=');
        case '.': return line_end(lexer, second == '.');
        case '<':
            if (second != '-') return found(lexer, BLANK_LINE);
            advance(lexer);
            return line_end(lexer, next(lexer) == '>');
        default: return found(lexer, NEWLINE);
    }
}

// ---- units: one word, such as `mL`, `%w/w`, `1/s` or `kg/(mol*s)`

static bool is_unit_letter(int32_t c) {
    return is_letter(c) || c == '_' || c == 0xB5 || c == 0x3BC || c == 0xB0 || c == 0x3A9 || c == 0xC5;
}

static void mark(TSLexer *lexer, bool marking) {
    if (marking) lexer->mark_end(lexer);
}

// What has been read beyond what is marked: nothing, a `/` that may go on with another name, or something that ends the unit.
typedef enum { NOTHING, SLASH, STOP } Beyond;

// `^-2`, `^1/2`.
static Beyond unit_exponent(TSLexer *lexer, bool marking) {
    if (!accept(lexer, '^')) return NOTHING;
    accept(lexer, '-');
    if (!is_digit(next(lexer))) return STOP;
    while (is_digit(next(lexer))) advance(lexer);
    mark(lexer, marking);
    if (!accept(lexer, '/')) return NOTHING;
    if (!is_digit(next(lexer))) return SLASH;
    while (is_digit(next(lexer))) advance(lexer);
    mark(lexer, marking);
    return NOTHING;
}

// A name with its exponent. False where there is none.
static bool unit_name(TSLexer *lexer, bool marking, Beyond *beyond) {
    if (accept(lexer, '%')) {
        mark(lexer, marking);
        if (is_letter(next(lexer))) {
            advance(lexer);
            mark(lexer, marking);
            if (accept(lexer, '/')) {
                if (!is_letter(next(lexer))) {
                    *beyond = SLASH;
                    return true;
                }
                advance(lexer);
                mark(lexer, marking);
            }
        }
    } else if (is_unit_letter(next(lexer))) {
        while (is_unit_letter(next(lexer)) || is_digit(next(lexer))) advance(lexer);
        mark(lexer, marking);
    } else {
        return false;
    }
    *beyond = unit_exponent(lexer, marking);
    return true;
}

// `mol*s)^2` after the bracket: nothing of it is marked before it is whole.
static bool unit_group(TSLexer *lexer, Beyond *beyond) {
    do {
        *beyond = NOTHING;
        if (!unit_name(lexer, false, beyond) || *beyond == STOP) return false;
    } while (*beyond == SLASH || accept(lexer, '*') || accept(lexer, '/'));
    if (!accept(lexer, ')')) return false;
    lexer->mark_end(lexer);
    *beyond = unit_exponent(lexer, true);
    return true;
}

// Where the unit ends is marked; a name character must not follow there.
static bool scan_unit(TSLexer *lexer, enum Token token) {
    Beyond beyond = NOTHING;
    if (accept(lexer, '1') && !accept(lexer, '/')) return false;
    if (is_letter(next(lexer))) {
        Word word;
        read_word(lexer, &word);
        bool word_alone = !is_unit_letter(next(lexer));
        if (word_alone && (is_reserved(lexer, &word) || is_one_of(&word, NOT_UNITS))) return false;
        while (is_unit_letter(next(lexer)) || is_digit(next(lexer))) advance(lexer);
        lexer->mark_end(lexer);
        beyond = unit_exponent(lexer, true);
    } else if (accept(lexer, '(')) {
        if (!unit_group(lexer, &beyond)) return false;
    } else if (!unit_name(lexer, true, &beyond)) {
        return false;
    }
    while (beyond != STOP) {
        if (beyond == NOTHING) {
            if (is_idc(next(lexer))) return false;
            if (!accept(lexer, '/') && !accept(lexer, '*')) break;
        }
        beyond = NOTHING;
        if (accept(lexer, '(') ? !unit_group(lexer, &beyond) : !unit_name(lexer, true, &beyond)) break;
    }
    return found(lexer, token);
}

// ---- words

// Whether the word that has been read can be one of a verb; the next ones must not begin a calculation.
// Whether `=`, `+=` or `-=` follows the first word of a step, or the word after it: `n += 1`, `var n: Ratio = 0`.
static bool is_assigned(TSLexer *lexer) {
    while (is_blank(next(lexer))) advance(lexer);
    if (accept(lexer, '+') || accept(lexer, '-')) return next(lexer) == '=';
    if (accept(lexer, '=')) return next(lexer) != '=';
    return false;
}

// Whether `var` declares a name. Where it does not, the step begins with a verb of several words, of which the second has been passed.
static bool is_declared(TSLexer *lexer, Word *word) {
    if (strcmp(word->text, " var ") != 0 || !is_blank(next(lexer))) return false;
    while (is_blank(next(lexer))) advance(lexer);
    if (!is_letter(next(lexer)) && next(lexer) != '_') return false;
    while (is_idc(next(lexer))) advance(lexer);
    while (is_blank(next(lexer))) advance(lexer);
    return next(lexer) == ':' || is_assigned(lexer);
}

static bool is_bare_word(TSLexer *lexer, bool first) {
    switch (next(lexer)) {
        case '(': case '[': case '\'': return false;
        case '.':
            advance(lexer);
            if (is_idc(next(lexer))) return false;
            return first || next(lexer) != '.';
        case ':':
            advance(lexer);
            return next(lexer) != ':';
    }
    if (first) return !is_assigned(lexer);
    if (!skip_space(lexer, true)) return false;
    if (next(lexer) == 'o') {
        Word word;
        read_word(lexer, &word);
        return strcmp(word.text, " of ") != 0;
    }
    int32_t sign = next(lexer);
    if (sign == '*' || sign == '^') return false;
    if (sign == '+' || sign == '-' || sign == '.') {
        advance(lexer);
        if (sign == '.') return next(lexer) != '.';
        return next(lexer) == '=' || (sign == '-' && next(lexer) == '>');
    }
    return true;
}

// Whether a preposition stands for a state: nothing that could be its argument follows.
static bool is_state_word(TSLexer *lexer) {
    if (!skip_space(lexer, false)) return false;
    if (lexer->eof(lexer)) return true;
    switch (next(lexer)) {
        case '\n': case ',': case ';': case ')': case ']': case '}': case '{': return true;
    }
    Word word;
    read_word(lexer, &word);
    return is_one_of(&word, AFTER_STATE_WORD);
}

// `2+`, `^2-` after the name of a species, with no name character after it.
static bool scan_charge(TSLexer *lexer) {
    accept(lexer, '^');
    while (is_digit(next(lexer))) advance(lexer);
    if (accept(lexer, '-')) {
        if (next(lexer) == '>') return false;
    } else if (!accept(lexer, '+')) {
        return false;
    }
    if (is_idc(next(lexer))) return false;
    lexer->mark_end(lexer);
    return true;
}

// `(s)`, `(l)`, `(g)`, `(aq)`.
static bool scan_phase(TSLexer *lexer) {
    if (!accept(lexer, '(')) return false;
    if (accept(lexer, 'a')) {
        if (!accept(lexer, 'q')) return false;
    } else if (!accept(lexer, 's') && !accept(lexer, 'l') && !accept(lexer, 'g')) {
        return false;
    }
    if (!accept(lexer, ')')) return false;
    lexer->mark_end(lexer);
    return true;
}

// Whether what follows a charge cannot follow an operator, so that it is a charge.
static bool ends_ion(TSLexer *lexer) {
    if (accept(lexer, '.')) return is_letter(next(lexer));
    if (!skip_space(lexer, false)) return false;
    if (lexer->eof(lexer)) return true;
    switch (next(lexer)) {
        case '\n': case ',': case ';': case ')': case ']': case '}': case '{': case '>': return true;
        case '=': case '!': advance(lexer); return next(lexer) == '=';
        case '<': advance(lexer); return next(lexer) != '-';
    }
    Word word;
    read_word(lexer, &word);
    return is_one_of(&word, AFTER_ION);
}

// What follows the name of a species; one without is a name like any other.
static bool scan_species(TSLexer *lexer, const bool *valid) {
    bool charged = next(lexer) != '(' && scan_charge(lexer);
    if (!charged && next(lexer) != '(') return false;
    bool phased = next(lexer) == '(' && scan_phase(lexer);
    if (!charged && !phased) return false;
    if (valid[SPECIES]) return found(lexer, SPECIES);
    // A phase that has been read in part hides what follows the charge; then it is none of these.
    if (valid[SPECIES_INDEX]) {
        if (!skip_space(lexer, true)) return false;
        if (next(lexer) == ']') return found(lexer, SPECIES_INDEX);
    }
    return valid[SPECIES_ION] && charged && ends_ion(lexer) && found(lexer, SPECIES_ION);
}

// Whether the word that has been read begins a step: after `for` a name and `in`.
static bool begins_step(TSLexer *lexer, const Word *word) {
    if (!is_one_of(word, STEPS)) return false;
    if (strcmp(word->text, " for ") != 0) return true;
    Word after;
    for (int i = 0; i < 2; i++) {
        while (is_blank(next(lexer))) advance(lexer);
        read_word(lexer, &after);
    }
    return strcmp(after.text, " in ") == 0;
}

static bool scan_word(TSLexer *lexer, const bool *valid) {
    bool letter = is_letter(next(lexer));
    Word word;
    lexer->mark_end(lexer);
    read_word(lexer, &word);
    if (valid[BESIDE] && begins_step(lexer, &word)) return found(lexer, BESIDE);
    lexer->mark_end(lexer);
    if (valid[FIRST_WORD] || valid[NEXT_WORD]) {
        bool first = valid[FIRST_WORD];
        if (is_reserved(lexer, &word) || (first && is_declared(lexer, &word)) || !is_bare_word(lexer, first)) return false;
        return found(lexer, first ? FIRST_WORD : NEXT_WORD);
    }
    if (valid[STATE_WORD] && is_one_of(&word, LABELS)) return is_state_word(lexer) && found(lexer, STATE_WORD);
    if (letter && (valid[SPECIES] || valid[SPECIES_INDEX] || valid[SPECIES_ION])) return scan_species(lexer, valid);
    return false;
}

// ---- what tree-sitter calls

void *tree_sitter_mtx_external_scanner_create(void) { return NULL; }

void tree_sitter_mtx_external_scanner_destroy(void *payload) { (void)payload; }

unsigned tree_sitter_mtx_external_scanner_serialize(void *payload, char *buffer) {
    (void)payload;
    (void)buffer;
    return 0;
}

void tree_sitter_mtx_external_scanner_deserialize(void *payload, const char *buffer, unsigned length) {
    (void)payload;
    (void)buffer;
    (void)length;
}

bool tree_sitter_mtx_external_scanner_scan(void *payload, TSLexer *lexer, const bool *valid) {
    (void)payload;
    bool recovering = valid[ERROR_SENTINEL];
    if (!recovering && (valid[TIGHT] || valid[SAME_LINE])) {
        while (!valid[TIGHT] && is_blank(next(lexer))) lexer->advance(lexer, true);
        lexer->mark_end(lexer);
        // A line end has no place here, whatever follows it.
        if (accept(lexer, '\n')) return found(lexer, NEWLINE);
        if (!valid[TIGHT]) return found(lexer, SAME_LINE);
        return (is_letter(next(lexer)) || next(lexer) == '_') && found(lexer, TIGHT);
    }
    if (!recovering && valid[UNIT]) {
        if (next(lexer) == ' ') lexer->advance(lexer, true);
        int32_t c = next(lexer);
        if (is_unit_letter(c) || c == '%' || c == '1' || c == '(') return scan_unit(lexer, UNIT);
    }
    while (is_blank(next(lexer))) lexer->advance(lexer, true);
    if (next(lexer) == '\n') return scan_line_end(lexer, valid);
    if (recovering || lexer->eof(lexer)) return false;
    if (valid[UNIT_AFTER_AS]) return scan_unit(lexer, UNIT_AFTER_AS);
    if (valid[LESS] && accept(lexer, '<')) {
        lexer->mark_end(lexer);
        return next(lexer) != '-' && next(lexer) != '=' && found(lexer, LESS);
    }
    if (is_letter(next(lexer)) || next(lexer) == '_') return scan_word(lexer, valid);
    return false;
}
