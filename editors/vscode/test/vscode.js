// As much of the editor as the extension and its client touch, without a window: what is registered and published can be looked at.
'use strict';

const Module = require('module');
const path = require('path');
const { pathToFileURL, fileURLToPath } = require('url');

class Disposable {
  constructor(dispose = () => {}) { this.dispose = dispose; }
  static from(...all) { return new Disposable(() => all.forEach((one) => one.dispose())); }
}

class EventEmitter {
  constructor() {
    this.listeners = new Set();
    this.event = (listener, self, disposables) => {
      const bound = self ? listener.bind(self) : listener;
      this.listeners.add(bound);
      const disposable = new Disposable(() => this.listeners.delete(bound));
      if (Array.isArray(disposables)) disposables.push(disposable);
      return disposable;
    };
  }
  fire(value) { for (const listener of [...this.listeners]) listener(value); }
  dispose() { this.listeners.clear(); }
}

class Uri {
  constructor(text) {
    this.text = text;
    this.scheme = text.slice(0, text.indexOf(':'));
    this.path = this.scheme === 'file' ? new URL(text).pathname : text.slice(text.indexOf(':') + 1);
    this.authority = '';
  }
  get fsPath() { return this.scheme === 'file' ? fileURLToPath(this.text) : this.path; }
  toString() { return this.text; }
  with() { return this; }
  static parse(text) { return new Uri(text); }
  static file(name) { return new Uri(pathToFileURL(name).href); }
}

class Position {
  constructor(line, character) { Object.assign(this, { line, character }); }
  isEqual(other) { return this.line === other.line && this.character === other.character; }
}

class Range {
  constructor(a, b, c, d) {
    [this.start, this.end] = typeof a === 'number' ? [new Position(a, b), new Position(c, d)] : [a, b];
  }
}

class Diagnostic {
  constructor(range, message, severity) { Object.assign(this, { range, message, severity }); }
}

class CancellationTokenSource {
  constructor() { this.token = { isCancellationRequested: false, onCancellationRequested: () => new Disposable() }; }
  cancel() {}
  dispose() {}
}

class Document {
  constructor(uri, text) {
    Object.assign(this, { uri, text, languageId: 'mtx', version: 1, isDirty: false, isClosed: false, fileName: uri.fsPath });
  }
  getText() { return this.text; }
  get lineCount() { return this.text.split('\n').length; }
  async save() { return true; }
}

const matches = (selector, document) =>
  [selector].flat().some((one) => (!one.language || one.language === document.languageId) && (!one.scheme || one.scheme === document.uri.scheme));

const kind = (value) => ({ value, append: (more) => kind(`${value}.${more}`) });

// A mock of the editor: { vscode, ... what the extension did with it }.
function editor(settings = {}) {
  const seen = { diagnostics: new Map(), commands: new Map(), errors: [], status: undefined, output: [], tasks: [], panels: [], shown: [], hovers: [], providers: {}, opened: [] };
  const events = {};
  const event = (name) => (events[name] ??= new EventEmitter()).event;
  const documents = [];

  const names = {
    Disposable, EventEmitter, Uri, Position, Range, Diagnostic, CancellationTokenSource,
    env: { language: 'en', appName: 'test', machineId: 'test', openExternal: async (uri) => seen.opened.push(uri.toString()) },
    version: '1.90.0',
    DiagnosticSeverity: { Error: 0, Warning: 1, Information: 2, Hint: 3 },
    DiagnosticTag: { Unnecessary: 1, Deprecated: 2 },
    LanguageStatusSeverity: { Information: 0, Warning: 1, Error: 2 },
    ViewColumn: { Beside: -2 },
    ProgressLocation: { Window: 10, Notification: 15 },
    TaskScope: { Global: 1, Workspace: 2 },
    TaskRevealKind: { Always: 1 },
    CodeActionKind: new Proxy({}, { get: (_, name) => kind(String(name).toLowerCase()) }),
    ProcessExecution: class { constructor(process, args, options) { Object.assign(this, { process, args, options }); } },
    Task: class { constructor(definition, scope, name, source, execution, matchers) { Object.assign(this, { definition, scope, name, source, execution, matchers }); } },
    window: {
      activeTextEditor: undefined,
      visibleTextEditors: [],
      tabGroups: { all: [], onDidChangeTabs: event('tabs') },
      createOutputChannel: () => ({ append: (text) => seen.output.push(text), appendLine: (text) => seen.output.push(text), show() {}, clear() {}, dispose() {} }),
      showErrorMessage: async (text) => { seen.errors.push(text); },
      showWarningMessage: async (text) => { seen.errors.push(text); },
      showInformationMessage: async () => undefined,
      showTextDocument: async (document) => { seen.shown.push(document); },
      withProgress: async (_, act) => act({ report() {} }, new CancellationTokenSource().token),
      createWebviewPanel: (type, title) => { const panel = { title, webview: { html: '' } }; seen.panels.push(panel); return panel; },
      onDidChangeActiveTextEditor: event('activeEditor'),
      onDidChangeVisibleTextEditors: event('visibleEditors'),
      onDidChangeTextEditorSelection: event('selection'),
    },
    workspace: {
      workspaceFolders: undefined,
      textDocuments: documents,
      notebookDocuments: [],
      getConfiguration: (section) => ({ get: (name, fallback) => settings[`${section}.${name}`] ?? fallback, has: () => false, inspect: () => undefined }),
      getWorkspaceFolder: () => undefined,
      asRelativePath: (file) => path.basename(file),
      registerTextDocumentContentProvider: (scheme, provider) => { seen.providers[scheme] = provider; return new Disposable(); },
      createFileSystemWatcher: () => ({ onDidCreate: event('none'), onDidChange: event('none'), onDidDelete: event('none'), dispose() {} }),
      applyEdit: async () => true,
      openTextDocument: async (uri) => new Document(uri, seen.providers[uri.scheme].provideTextDocumentContent(uri)),
      fs: {},
    },
    languages: {
      match: (selector, document) => (matches(selector, document) ? 10 : 0),
      setTextDocumentLanguage: async (document, languageId) => Object.assign(document, { languageId }),
      createLanguageStatusItem: () => (seen.status = { dispose() {} }),
      createDiagnosticCollection: () => ({
        set: (uri, found) => { seen.diagnostics.set(uri.toString(), found ?? []); (events.published ??= new EventEmitter()).fire(uri); },
        delete: (uri) => seen.diagnostics.delete(uri.toString()),
        clear: () => seen.diagnostics.clear(),
        dispose() {},
      }),
    },
    commands: {
      registerCommand: (name, act) => { seen.commands.set(name, act); return new Disposable(() => seen.commands.delete(name)); },
      executeCommand: async (name) => (name === 'vscode.executeHoverProvider' ? seen.hovers : undefined),
    },
    tasks: { registerTaskProvider: () => new Disposable(), executeTask: async (task) => { seen.tasks.push(task); } },
  };

  // What is not named above: events never fire, registrations do nothing, and other names are classes.
  const filled = (object, prefix) => new Proxy(object, {
    get(target, name) {
      if (name in target || typeof name === 'symbol') return target[name];
      if (name.startsWith('onDid') || name.startsWith('onWill')) return (target[name] = event(`${prefix}.${name}`));
      if (name.startsWith('register')) return (target[name] = (...given) => { seen.providers[name] = given; return new Disposable(); });
      return undefined;
    },
  });
  for (const name of ['window', 'workspace', 'languages', 'commands', 'tasks']) names[name] = filled(names[name], name);
  const vscode = new Proxy(names, {
    get(target, name) {
      if (name in target || typeof name === 'symbol' || name === 'then') return target[name];
      return /^[A-Z]/.test(name) ? (target[name] = class { constructor(...given) { this.given = given; } }) : undefined;
    },
  });

  return {
    vscode, seen, documents,
    open(uri, text) {
      const document = new Document(uri, text);
      documents.push(document);
      names.window.activeTextEditor = { document, selection: { active: new Position(0, 0) } };
      events['workspace.onDidOpenTextDocument']?.fire(document);
      return document;
    },
    type(document, text) {
      const lines = document.text.split('\n');
      const range = new Range(0, 0, lines.length - 1, lines[lines.length - 1].length);
      const contentChanges = [{ range, rangeOffset: 0, rangeLength: document.text.length, text }];
      Object.assign(document, { text, version: document.version + 1 });
      events['workspace.onDidChangeTextDocument']?.fire({ document, contentChanges, reason: undefined });
    },
    // Resolves when the findings of a file fit.
    async published(uri, fits, limit = 60_000) {
      const until = Date.now() + limit;
      while (Date.now() < until) {
        const found = seen.diagnostics.get(uri.toString());
        if (found && fits(found)) return found;
        await new Promise((resolve) => setTimeout(resolve, 20));
      }
      throw new Error(`no such findings: ${JSON.stringify(seen.diagnostics.get(uri.toString()))}`);
    },
  };
}

// Loads a module for which `vscode` is the mock.
function load(file, vscode) {
  const original = Module._load;
  Module._load = (name, ...rest) => (name === 'vscode' ? vscode : original(name, ...rest));
  try {
    delete require.cache[require.resolve(file)];
    return require(file);
  } finally {
    Module._load = original;
  }
}

module.exports = { editor, load };
