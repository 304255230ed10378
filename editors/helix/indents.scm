; For Helix, which names indentation in its own way.
[
  (block) (law_block) (fields) (options) (members) (asset_body) (lab_body) (fills) (wires) (study) (fit) (list) (tuple) (arguments) (parameters)
] @indent

[ "}" ")" "]" ] @outdent
