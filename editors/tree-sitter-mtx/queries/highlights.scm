; No two patterns meet on one node, so that it does not matter whether an editor lets the first or the last one win.

(comment) @comment
(doc_comment) @comment.documentation

; ---- literals
(number) @number
(unit) @type.builtin
(unit_name) @type.builtin
(string) @string
(escape_sequence) @string.escape
(placeholder) @string.special
(state_word) @constant
(place) @constant
(species) @constant
((identifier) @constant.builtin
  (#any-of? @constant.builtin "true" "false" "nothing" "unlimited" "elapsed" "self"))

; ---- declarations
(header "mtx" @keyword)
[
  "use" "dimension" "unit" "species" "solution" "reaction" "equilibrium" "interaction" "reactive_group" "material" "incompatible" "allow" "hazard" "caution"
  "capability" "asset" "process" "event" "relation" "extern" "fn" "const" "framing" "driver" "lab" "skill" "workflow" "study" "fit" "test" "table"
  "point" "prefixes" "labelled" "symmetric" "also" "any" "where" "when" "per"
] @keyword

(role) @keyword.storage
[ "view" "command" "frame" "solid" "joint" "include" "between" "keeps" "ends" "slides" "turns" "pitch" "holding" ] @keyword
[
  "needs" "presumes" "warns" "ever" "fails" "effect" "each" "takes" "option" "says" "moves" "grips" "frees" "leads" "because" "straight" "driving"
  "upright" "tilted" "about" "home" "joints"
] @keyword
[
  "sends" "asks" "expects" "alive" "reply" "answers" "hears" "ignores" "reading" "identity" "open" "close" "halt" "safe" "play" "over" "vary" "runs" "report" "data"
  "estimate" "match" "noise" "log"
] @keyword

; ---- steps
[ "let" "var" "step" "claim" "record" "note" "ask" "expect" "keep" "hold" "start" "sequence" "parallel" ] @keyword
[ "wait" "await" "until" "timeout" "within" "after" "every" "times" "max" ] @keyword.control
[ "if" "else" ] @keyword.control.conditional
[ "repeat" "for" "while" ] @keyword.control.repeat
[ "try" "retry" "fail" "finally" ] @keyword.control.exception
(return_statement "return" @keyword.control.return)

; ---- operators
[ "and" "or" "not" "is" "of" "to" "from" "into" "onto" "on" "in" "with" "by" "at" "using" "through" "as" ] @keyword.operator
(label) @keyword.operator
[ "==" "!=" "<=" ">=" ">" "<" "+" "-" "*" "/" "^" "+-" ".." "=" "+=" "-=" "->" "<->" "<-" "&" "|" "?" "'" ] @operator

[ "(" ")" "[" "]" "{" "}" ] @punctuation.bracket
[ "," ";" ":" "::" "." ] @punctuation.delimiter

; ---- names
; The last of several words is the verb's or a thing's: only the compiler knows.
(call . (verb_word) @function)
(call (verb_word) @function . (verb_word))
(verb (identifier) @function)
(call_expression function: (identifier) @function.call)
(vary draw: (identifier) @function.call)
(function name: (identifier) @function)
[
  (workflow name: (identifier) @function)
  (test name: (identifier) @function)
  (study name: (identifier) @function)
  (fit name: (identifier) @function)
  (relation name: (identifier) @function)
]
[
  (process name: (identifier) @function)
  (event name: (identifier) @function)
  (hazard name: (identifier) @function)
]
[
  (capability name: (identifier) @type)
  (asset name: (identifier) @type)
  (dimension name: (identifier) @type)
  (driver name: (identifier) @type)
  (driver type: (identifier) @type)
  (extends type: (identifier) @type)
  (type name: (identifier) @type)
  (type_arguments (identifier) @type)
  (literal type: (identifier) @type)
  (instance type: (identifier) @type)
  (part type: (identifier) @type)
  (grid type: (identifier) @type)
  (extends type: (scoped_name name: (identifier) @type))
  (type name: (scoped_name name: (identifier) @type))
  (literal type: (scoped_name name: (identifier) @type))
  (instance type: (scoped_name name: (identifier) @type))
]
[
  (reaction name: (identifier) @constant)
  (interaction name: (identifier) @constant)
  (solution name: (identifier) @constant)
  (material name: (identifier) @constant)
  (reactive_group name: (identifier) @constant)
  (constant name: (identifier) @constant)
  (table name: (identifier) @constant)
]
((use (identifier) @type) (#match? @type "^[A-Z]"))
((use path: (scoped_name name: (identifier) @type)) (#match? @type "^[A-Z]"))
(lab name: (identifier) @module)
(scoped_name scope: (identifier) @module)
(source format: (identifier) @module)
(workflow lab: (identifier) @module)
(parameter name: (identifier) @variable.parameter)
(named_argument name: (identifier) @variable.parameter)
(let_statement name: (identifier) @variable)
(var_statement name: (identifier) @variable)
(set_statement name: (identifier) @variable)
(law_let name: (identifier) @variable)
(for_statement name: (identifier) @variable)
(law_for name: (identifier) @variable)
(start_statement name: (identifier) @variable)
(await_statement name: (identifier) @variable)
(step_statement name: (identifier) @label)
(instance name: (identifier) @variable)
(include name: (identifier) @variable)
(part name: (identifier) @property)
(grid name: (identifier) @property)
(frame name: (identifier) @property)
(joint name: (identifier) @property)
(field_name) @property
(member_name) @property
(failure) @label
