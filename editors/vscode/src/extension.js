// Starts `matterixc lsp` and offers what else the command can do. What a text means is the server's business, never this file's.
'use strict';

const vscode = require('vscode');
const { LanguageClient, State, TransportKind } = require('vscode-languageclient/node');

const { Contents } = require('./contents');
const { locate, missing, understands } = require('./program');
const { plan } = require('./plan');
const { View } = require('./view');
const { provider: taskProvider, task } = require('./tasks');

// Modules of the library and pages of codes that lie in no folder.
const LIBRARY_SCHEME = 'mtx-std';

class Extension {
  constructor(context) {
    this.context = context;
    this.client = undefined;
    this.output = vscode.window.createOutputChannel('mtx');
    this.status = vscode.languages.createLanguageStatusItem('mtx.server', { language: 'mtx' });
    this.status.name = 'matterixc';
    this.status.command = { command: 'mtx.restart', title: 'Restart' };
    this.view = new View(this.output);
    this.contents = new Contents();
    context.subscriptions.push(this.output, this.status, this.view, this.contents);
  }

  tell(text, severity, detail) {
    this.status.text = text;
    this.status.severity = severity;
    this.status.detail = detail;
  }

  // Starts the server; where the program is missing, says so once.
  async start() {
    const settings = vscode.workspace.getConfiguration('mtx');
    const wanted = settings.get('server.path', 'matterixc');
    const command = locate(wanted);
    if (!command) {
      this.tell('matterixc not found', vscode.LanguageStatusSeverity.Error, `\`${wanted}\` is no program`);
      missing(wanted);
      return;
    }
    const args = settings.get('server.arguments', ['lsp']);
    if (!(await understands(command, args))) return this.failed(command, `\`${args.join(' ')}\` is nothing that it does`);
    const run = { command, args, transport: TransportKind.stdio };
    this.client = new LanguageClient('mtx', 'matterixc', { run, debug: run }, {
      documentSelector: [
        { language: 'mtx', scheme: 'file' },
        { language: 'mtx', scheme: 'untitled' },
        { language: 'mtx', scheme: LIBRARY_SCHEME },
      ],
      outputChannel: this.output,
    });
    this.client.onDidChangeState(({ newState }) => {
      if (newState === State.Starting) this.tell('matterixc starts', vscode.LanguageStatusSeverity.Information);
      if (newState === State.Stopped) this.tell('matterixc has stopped', vscode.LanguageStatusSeverity.Warning);
    });
    try {
      await this.client.start();
      const { name = 'matterixc', version = '' } = this.client.initializeResult?.serverInfo ?? {};
      this.tell(`${name} ${version}`.trim(), vscode.LanguageStatusSeverity.Information, command);
    } catch (error) {
      this.failed(command, String(error.message ?? error));
    }
  }

  async failed(command, why) {
    this.tell('matterixc does not answer', vscode.LanguageStatusSeverity.Error, why);
    this.output.appendLine(why);
    const text = `\`${command}\` does not work as a language server. Is it older than this extension?`;
    if ((await vscode.window.showErrorMessage(text, 'Show the output')) !== undefined) this.output.show();
  }

  async stop() {
    const client = this.client;
    this.client = undefined;
    // A server that never came up cannot be stopped either.
    await client?.dispose().catch(() => undefined);
  }

  async restart() {
    await this.stop();
    await this.start();
  }

  // The file in front, as it stands on the disk after this.
  async file() {
    const document = vscode.window.activeTextEditor?.document;
    if (document?.languageId !== 'mtx' || document.uri.scheme !== 'file') {
      vscode.window.showInformationMessage('Open an .mtx file on this machine first.');
      return undefined;
    }
    if (document.isDirty && !(await document.save())) return undefined;
    return document.uri;
  }

  // Does something with the file and the program, if both are there.
  async withFile(act) {
    const uri = await this.file();
    if (!uri) return undefined;
    const wanted = vscode.workspace.getConfiguration('mtx', uri).get('server.path', 'matterixc');
    const command = locate(wanted);
    if (!command) return missing(wanted);
    return act(command, uri);
  }

  execute(what) {
    return this.withFile((command, uri) => {
      const more = what === 'run' ? vscode.workspace.getConfiguration('mtx', uri).get('run.arguments', []) : [];
      return vscode.tasks.executeTask(task(command, what, uri.fsPath, more, vscode.workspace.getWorkspaceFolder(uri), []));
    });
  }

  register() {
    const commands = {
      check: () => this.execute('check'),
      run: () => this.execute('run'),
      plan: () => this.withFile((command, uri) => plan(command, uri, this.output)),
      view: () => this.withFile((command, uri) => this.view.open(command, uri)),
      contents: () => this.contents.show(),
      restart: () => this.restart(),
    };
    const disposables = Object.entries(commands).map(([name, act]) => vscode.commands.registerCommand(`mtx.${name}`, act));
    const library = {
      provideTextDocumentContent: async (uri) =>
        (await this.client?.sendRequest('workspace/textDocumentContent', { uri: uri.toString() }))?.text,
    };
    this.context.subscriptions.push(
      ...disposables,
      vscode.workspace.registerTextDocumentContentProvider(LIBRARY_SCHEME, library),
      vscode.tasks.registerTaskProvider('matterixc', taskProvider()),
      vscode.workspace.onDidChangeConfiguration((change) => {
        if (change.affectsConfiguration('mtx.server')) this.restart();
      }),
    );
  }
}

let extension;

async function activate(context) {
  extension = new Extension(context);
  extension.register();
  await extension.start();
  return extension;
}

function deactivate() {
  return extension?.stop();
}

module.exports = { activate, deactivate };
