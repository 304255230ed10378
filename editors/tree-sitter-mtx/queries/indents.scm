; For Neovim. Helix takes `indent` and `outdent` from its own copy in editors/README.md.
[
  (block) (law_block) (fields) (options) (members) (asset_body) (lab_body) (fills) (wires) (study) (fit) (list) (tuple) (arguments) (parameters)
] @indent.begin

[ "}" ")" "]" ] @indent.branch @indent.end
(comment) @indent.ignore
(doc_comment) @indent.ignore
