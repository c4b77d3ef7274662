// The grammar on lessons of the course, with that of Markdown around it, as Visual Studio Code has them.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import test from 'node:test';

const require = createRequire(import.meta.url);
const { INITIAL, Registry, parseRawGrammar } = require('vscode-textmate');
const oniguruma = require('vscode-oniguruma');

const OWN = new URL('../syntaxes/coursebuild.tmLanguage.json', import.meta.url);
const NAMES = { 'text.html.markdown': 'markdown', 'source.json': 'json', 'source.python': 'python', 'text.xml': 'xml' };

await oniguruma.loadWASM(readFileSync(require.resolve('vscode-oniguruma/release/onig.wasm')));
const registry = new Registry({
  onigLib: Promise.resolve({
    createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
    createOnigString: (text) => new oniguruma.OnigString(text),
  }),
  getInjections: (scope) => (scope === 'text.html.markdown' ? ['markdown.coursebuild'] : []),
  loadGrammar: async (scope) => {
    const name = NAMES[scope];
    const place = scope === 'markdown.coursebuild' ? OWN : name && require.resolve(`tm-grammars/grammars/${name}.json`);
    return place ? parseRawGrammar(readFileSync(place, 'utf8'), String(place)) : null;
  },
});
const markdown = await registry.loadGrammar('text.html.markdown');

/** The scopes of each piece of a text: [piece, scopes][]. */
function pieces(text) {
  let stack = INITIAL;
  return text.split('\n').flatMap((line) => {
    const { tokens, ruleStack } = markdown.tokenizeLine(line, stack);
    stack = ruleStack;
    return tokens.map((token) => [line.slice(token.startIndex, token.endIndex), token.scopes.join(' ')]);
  });
}

/** Assert that a piece has a scope, in one of the places where it stands. */
function has(text, piece, scope) {
  const found = pieces(text).filter(([one]) => one === piece).map(([, scopes]) => scopes);
  assert.ok(found.some((scopes) => ` ${scopes}`.includes(` ${scope}`)), `${piece}: ${found}`);
}

const lesson = (name) => readFileSync(new URL(`../../../content/lessons/${name}.md`, import.meta.url), 'utf8');

test('fences of a lesson have their kinds, keys and languages', () => {
  const text = lesson('4.2-mass-and-inertia');
  for (const kind of ['lab', 'quiz', 'python', 'text']) has(text, kind, 'entity.name.type.fence.coursebuild');
  has(text, 'examples/l4_2_strip.py', 'string.unquoted.coursebuild');
  has(text, 'figure', 'entity.other.attribute-name.coursebuild');
  has(text, 'questions', 'support.type.property-name.json');
  has(text, 'import', 'keyword.control.import.python');
});

test('what a lesson binds, defines and calls out is coloured', () => {
  const text = lesson('4.2-mass-and-inertia');
  for (const key of ['out', 'given', 'term', 'symbol', 'unit']) has(text, key, 'entity.other.attribute-name.coursebuild');
  for (const kind of ['established', 'derivation', 'try', 'caution']) has(text, kind, 'keyword.other.callout.coursebuild');
  has(text, 'The parallel-axis theorem', 'markup.heading.callout.coursebuild');
  has(text, '#eq:inertia-tensor', 'entity.name.label.coursebuild');
  for (const word of ['Output', 'Figure']) has(text, word, 'keyword.other.caption.coursebuild');
});

test('no fence runs on into the text below it', () => {
  for (const name of ['0.1-what-a-simulator-computes', '4.2-mass-and-inertia', '9.4-stability']) {
    const headings = pieces(lesson(name)).filter(([, scopes]) => /entity\.name\.section\.markdown/.test(scopes));
    const own = lesson(name).replace(/^```[\s\S]*?^```$/gm, '').match(/^#{2,} .*$/gm);
    assert.deepEqual(headings.map(([text]) => text).join(' '), own.map((text) => text.replace(/^#+ /, '')).join(' '));
  }
});

test('models and cards are read as what they are', () => {
  const text = '> ```mjcf fragment="worldbody"\n> <geom size="1"/>\n> ```\n\n```io\nINPUT: a\nPROCESS: b\n```\n\n```lab mjcf title="A"\n<mujoco/>\n```\n';
  for (const tag of ['geom', 'mujoco']) has(text, tag, 'entity.name.tag');
  has(text, 'PROCESS', 'keyword.other.io.coursebuild');
  has(text, 'fragment', 'entity.other.attribute-name.coursebuild');
});

test('an output is one by its kind or by its caption, in each language of the interface', () => {
  const fence = '```output digits\n1.5\n```\n';
  has(fence, 'output', 'entity.name.type.fence.coursebuild');
  has(fence, 'digits', 'entity.other.attribute-name.coursebuild');
  for (const word of ['Ausgabe', 'Salida', 'Sortie', 'المخرجات']) has(`${word} :\n\n`, word, 'keyword.other.caption.coursebuild');
});

test('code that shows such marks is code', () => {
  const text = '`[a]{term}` and `` `1`{out} ``\n\n````markdown\n```lab\n> [!note] N\n````\n';
  assert.ok(pieces(text).every(([, scopes]) => !scopes.includes('coursebuild')));
});
