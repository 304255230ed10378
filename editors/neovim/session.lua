-- Works in Neovim as its user would, with the settings of docs/editor.md and the real language server:
--   nvim --headless -u NONE -i NONE -l editors/neovim/session.lua
-- `matterixc` is on the path. Ends with status 1 and says what was otherwise than it should.

local here = vim.fs.dirname(debug.getinfo(1, "S").source:sub(2))
local root = vim.fs.normalize(here .. "/../..")
local folder = vim.fn.tempname()
vim.fn.mkdir(folder, "p")

-- How long an answer may take on a machine that does other work besides, ms.
local PATIENCE = 60000

local function expect(holds, what, seen)
  if not holds then
    io.stderr:write("not so: " .. what .. "\n" .. (seen ~= nil and vim.inspect(seen) .. "\n" or ""))
    vim.cmd("cquit 1")
  end
  print("ok: " .. what)
end

local function wait(what, holds, seen)
  expect(vim.wait(PATIENCE, holds, 20), what, seen and seen())
end

local function lines(...) return table.concat({ ... }, "\n") .. "\n" end

local function write(name, text)
  local path = folder .. "/" .. name
  vim.fn.writefile(vim.split(text, "\n"), path, "b")
  return path
end

local function settings()
  local page = table.concat(vim.fn.readfile(root .. "/docs/editor.md"), "\n")
  local block = page:match("%*%*Neovim%*%*.-```lua\n(.-)```")
  expect(block ~= nil, "docs/editor.md says how Neovim is set up")
  vim.cmd("filetype plugin indent on")
  assert(load(block))()
end

local part = write("part.mtx", lines(
  "mtx 1", "", "use std::heating", "",
  "/// How warm.", "const warm = 40 degC"
))
local main = write("main.mtx", lines(
  "mtx 1", "", "use part", "use std::heating", "use std::glassware", "",
  "/// µ°🧪 before names", "",
  "lab bench {", "    ambient: 25 degC", "    plate = IkaRetControl",
  "    cup = Beaker250mL on plate holding 100 g of water", "}", "",
  "workflow heating in bench {", "    heat plate to warm", "    wait 5 min", "    stop heating plate", "}"
))

local function row(text)
  for i, line in ipairs(vim.api.nvim_buf_get_lines(0, 0, -1, true)) do
    local at = line:find(text, 1, true)
    if at then return i, at - 1 end
  end
  error("no " .. text)
end

local function go(text)
  local line, column = row(text)
  vim.api.nvim_win_set_cursor(0, { line, column })
end

local function replace(old, new)
  local line, column = row(old)
  vim.api.nvim_buf_set_text(0, line - 1, column, line - 1, column + #old, vim.split(new, "\n"))
end

local function text() return table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, true), "\n") end

local function found(severity)
  return vim.diagnostic.get(0, severity and { severity = severity } or nil)
end

local function serious() return found({ min = vim.diagnostic.severity.WARN }) end

-- The text of the window that floats over the others.
local function floating()
  for _, window in ipairs(vim.api.nvim_list_wins()) do
    if vim.api.nvim_win_get_config(window).relative ~= "" then
      local buffer = vim.api.nvim_win_get_buf(window)
      return table.concat(vim.api.nvim_buf_get_lines(buffer, 0, -1, true), "\n"), window
    end
  end
end

local function hover(at, wanted)
  go(at)
  vim.lsp.buf.hover()
  wait("hover at `" .. at .. "` says `" .. wanted .. "`", function()
    local said = floating()
    return said and said:find(wanted, 1, true) ~= nil
  end, floating)
  local _, window = floating()
  vim.api.nvim_win_close(window, true)
end

local function asked(method, more)
  local params = vim.tbl_extend("force", vim.lsp.util.make_position_params(0, vim.lsp.get_clients()[1].offset_encoding), more or {})
  local answers, why = vim.lsp.buf_request_sync(0, method, params, PATIENCE)
  local answer = answers and answers[next(answers)]
  expect(answer and not answer.err, method .. " is answered", why or answer)
  return answer.result
end

settings()
vim.cmd.edit(main)
expect(vim.bo.filetype == "mtx", "the file is known by its name", vim.bo.filetype)
wait("the server is attached", function() return #vim.lsp.get_clients({ bufnr = 0 }) == 1 end)
local client = vim.lsp.get_clients({ bufnr = 0 })[1]
wait("the server has begun", function() return client.initialized end)

-- A mistake appears as it is typed, and goes as it is mended.
replace("5 min", "5 mg")
wait("a wrong unit is found", function() return #serious() == 1 end, found)
local finding = serious()[1]
expect(finding.source == "matterixc" and finding.code ~= nil, "the finding says whose it is", finding)
expect(finding.lnum == row("5 mg") - 1, "it stands in its line", finding)
replace("5 mg", "5 min")
wait("it is gone once it is mended", function() return #serious() == 0 end, found)

hover("stop heating", "plate")
hover("warm", "40")
hover("IkaRetControl", "IkaRetControl")

-- Definition: into another file, and into the library.
go("warm")
vim.lsp.buf.definition()
wait("a definition is gone to", function() return vim.api.nvim_buf_get_name(0):find("part.mtx", 1, true) ~= nil end)
vim.cmd.edit(main)
go("IkaRetControl")
vim.lsp.buf.definition()
wait("the library is opened", function() return vim.api.nvim_buf_get_name(0):find("main.mtx", 1, true) == nil end)
expect(text():find("asset IkaRetControl", 1, true) ~= nil, "it is the library's text")
wait("the library has no findings of its own", function() return #serious() == 0 end, found)
vim.cmd.edit(main)

-- A new name goes through all files.
go("warm")
vim.lsp.buf.rename("cosy")
wait("the name is new here", function() return text():find("to cosy", 1, true) ~= nil end, text)
local other = vim.fn.bufnr(part)
local there = table.concat(vim.api.nvim_buf_get_lines(other, 0, -1, true), "\n")
expect(there:find("const cosy", 1, true) ~= nil, "it is new in the other file", there)
wait("nothing is wrong after it", function() return #serious() == 0 end, found)

-- Completion, also in a line that is not whole.
replace("    wait 5 min", "    wait 5 min\n    hea")
local line = row("    wait 5 min") + 1
vim.api.nvim_win_set_cursor(0, { line, 7 })
local offered = asked("textDocument/completion", { position = { line = line - 1, character = 7 } })
local labels = vim.tbl_map(function(item) return item.label end, offered.items or offered)
expect(vim.iter(labels):any(function(label) return label:find("^heat") ~= nil end), "`heat` is offered", labels)
vim.api.nvim_buf_set_lines(0, line - 1, line, true, {})
wait("nothing is wrong again", function() return #serious() == 0 end, found)

-- Style.
replace("    wait 5 min", "  wait   5 min")
vim.lsp.buf.format({ timeout_ms = PATIENCE })
expect(text():find("\n    wait 5 min\n", 1, true) ~= nil, "the text has its style", text())

-- A correction.
replace("heat plate", "haet plate")
wait("a misspelt verb is found", function() return #serious() > 0 end, found)
go("haet")
vim.lsp.buf.code_action({ apply = true, filter = function(action) return action.kind == "quickfix" end })
wait("its correction is made", function() return text():find("heat plate", 1, true) ~= nil end, text)
wait("nothing is wrong at last", function() return #serious() == 0 end, found)

-- What is shown beside and on the text.
expect(vim.lsp.inlay_hint.is_enabled(), "hints beside the text are on")
go("IkaRetControl")
wait("words have their colours", function()
  local line, column = row("IkaRetControl")
  return #(vim.lsp.semantic_tokens.get_at_pos(0, line - 1, column) or {}) > 0
end)
expect(#asked("textDocument/documentSymbol") >= 2, "the outline has its items")
expect(#asked("textDocument/foldingRange") >= 2, "items can be folded")

-- The tree-sitter grammar, where it was built beside.
if #vim.api.nvim_get_runtime_file("parser/mtx.so", false) > 0 then
  vim.treesitter.start(0, "mtx")
  vim.treesitter.get_parser(0, "mtx"):parse(true)
  local line, column = row("workflow")
  local classes = vim.treesitter.get_captures_at_pos(0, line - 1, column)
  expect(vim.iter(classes):any(function(c) return c.capture:find("^keyword") ~= nil end), "`workflow` is a keyword", classes)
end

-- The end.
client:stop()
wait("the server ends", function() return client:is_stopped() end)
vim.fn.delete(folder, "rf")
vim.cmd("quitall!")
