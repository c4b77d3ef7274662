// Starts the language server of each open course, and its preview on demand.

const os = require('node:os');
const path = require('node:path');
const vscode = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');
const { commandOf, courseOf } = require('./course');
const { Preview } = require('./preview');

const clients = new Map();
const previews = new Map();
let output;

exports.activate = (context) => {
  output = vscode.window.createOutputChannel('coursebuild');
  context.subscriptions.push(
    output,
    vscode.commands.registerCommand('coursebuild.preview', preview),
    vscode.commands.registerCommand('coursebuild.restart', restart),
    vscode.workspace.onDidChangeWorkspaceFolders(startAll),
    vscode.workspace.onDidChangeConfiguration((event) => event.affectsConfiguration('coursebuild') && restart()),
    vscode.window.onDidChangeActiveTextEditor((editor) => previews.forEach((view) => view.show(editor))),
  );
  return startAll();
};

exports.deactivate = () => {
  previews.forEach((view) => view.process.kill('SIGINT'));
  return stopAll();
};

/** Start a server for each course among the folders, and stop those of removed courses. */
async function startAll() {
  const places = (vscode.workspace.workspaceFolders ?? []).map((folder) => courseOf(folder.uri.fsPath));
  const courses = new Set(places.filter(Boolean));
  await stopAll((folder) => !courses.has(folder));
  vscode.commands.executeCommand('setContext', 'coursebuild.active', courses.size > 0);
  await Promise.all([...courses].filter((folder) => !clients.has(folder)).map(start));
}

async function start(folder) {
  const command = find(folder);
  if (!command) return;
  const selector = (language, pattern) => ({ scheme: 'file', language, pattern: new vscode.RelativePattern(folder, pattern) });
  const client = new LanguageClient(
    'coursebuild',
    'coursebuild',
    { command, args: ['-C', folder, 'lsp'], options: { cwd: os.homedir() } },
    {
      documentSelector: [
        selector('markdown', '**/*.md'),
        { scheme: 'file', pattern: new vscode.RelativePattern(folder, '{content/course,models/**/*}.toml') },
      ],
      workspaceFolder: { uri: vscode.Uri.file(folder), name: path.basename(folder), index: 0 },
      outputChannel: output,
    },
  );
  clients.set(folder, client);
  try {
    await client.start();
  } catch {
    clients.delete(folder);
    output.appendLine(`${command} does not start`); // not in the message, where a path could be read as a link
    reportMissing('The language server does not start.', "pip install 'coursebuild[lsp]'");
  }
}

async function stopAll(accepts = () => true) {
  for (const folder of [...clients.keys()].filter(accepts)) {
    const client = clients.get(folder);
    clients.delete(folder);
    await client.dispose();
  }
}

async function restart() {
  await stopAll();
  await startAll();
}

function preview() {
  const editor = vscode.window.activeTextEditor;
  const folder = (editor && courseOf(editor.document.uri.fsPath)) ?? [...clients.keys()][0];
  const open = previews.get(folder);
  const command = folder && !open && find(folder);
  if (open) open.panel.reveal(undefined, true);
  else if (command) previews.set(folder, new Preview(folder, command, output, () => previews.delete(folder)));
}

/** The command of a course; if there is none, the user is told what to do. */
function find(folder) {
  const command = commandOf(vscode.workspace.getConfiguration('coursebuild').get('command'), folder);
  if (!command) reportMissing('There is no coursebuild in .venv or on the path.', "python -m venv .venv && .venv/bin/pip install 'coursebuild[lsp]'");
  return command;
}

async function reportMissing(problem, remedy) {
  const choice = await vscode.window.showErrorMessage(`${problem} Install it with: ${remedy}`, 'Open Settings', 'Try Again');
  if (choice === 'Open Settings') vscode.commands.executeCommand('workbench.action.openSettings', 'coursebuild.command');
  if (choice === 'Try Again') restart();
}
