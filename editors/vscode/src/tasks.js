// matterixc in the terminal, as tasks.
'use strict';

const vscode = require('vscode');

const { locate } = require('./program');

// A task without a shell, so that no name of a file has to be quoted.
function task(command, what, file, more, folder, matchers) {
  const form = what === 'check' ? ['--format', 'concise'] : [];
  const definition = { type: 'matterixc', command: what, file, arguments: more };
  const cwd = folder?.uri.fsPath;
  const execution = new vscode.ProcessExecution(command, [what, ...form, ...more, file], cwd ? { cwd } : {});
  const made = new vscode.Task(definition, folder ?? vscode.TaskScope.Workspace, `${what} ${vscode.workspace.asRelativePath(file)}`, 'matterixc', execution, matchers);
  made.presentationOptions = { reveal: vscode.TaskRevealKind.Always, clear: true };
  return made;
}

function program() {
  return locate(vscode.workspace.getConfiguration('mtx').get('server.path', 'matterixc'));
}

function provider() {
  return {
    provideTasks() {
      const document = vscode.window.activeTextEditor?.document;
      const command = program();
      if (document?.languageId !== 'mtx' || document.uri.scheme !== 'file' || !command) return [];
      const folder = vscode.workspace.getWorkspaceFolder(document.uri);
      return ['check', 'run', 'test'].map((what) => task(command, what, document.uri.fsPath, [], folder, ['$matterixc']));
    },
    resolveTask(given) {
      const command = program();
      const { command: what, file, arguments: more = [] } = given.definition;
      if (!command || !file) return undefined;
      const folder = typeof given.scope === 'object' ? given.scope : undefined;
      const made = task(command, what, file, more, folder, ['$matterixc']);
      // The editor knows a task by its definition.
      made.definition = given.definition;
      return made;
    },
  };
}

module.exports = { task, provider };
