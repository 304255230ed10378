[
  (block) (law_block) (fields) (options) (members) (asset_body) (lab_body) (fills) (wires) (study) (fit) (list) (tuple) (arguments) (parameters)
] @fold
