[
  (source_file) (workflow) (skill) (function) (capability) (asset) (process) (event) (relation) (hazard) (command) (lab) (test) (block) (law_block)
  (fold)
] @local.scope

(parameter name: (identifier) @local.definition.parameter)
(let_statement name: (identifier) @local.definition.var)
(var_statement name: (identifier) @local.definition.var)
(law_let name: (identifier) @local.definition.var)
(for_statement name: (identifier) @local.definition.var)
(law_for name: (identifier) @local.definition.var)
(fold (comparison left: (identifier) @local.definition.var))
(start_statement name: (identifier) @local.definition.var)
(step_statement name: (identifier) @local.definition.var)
(instance name: (identifier) @local.definition.var)
(capability name: (identifier) @local.definition.type)
(asset name: (identifier) @local.definition.type)
(function name: (identifier) @local.definition.function)
(constant name: (identifier) @local.definition.constant)

(identifier) @local.reference
