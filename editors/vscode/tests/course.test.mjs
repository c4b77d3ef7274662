// Where the extension looks for a course, its command and its pages.

import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import test from 'node:test';

const { addressIn, commandOf, courseOf, pageOf } = createRequire(import.meta.url)('../src/course.js');

const among = (...paths) => (path) => paths.includes(path);

test('the course of a file is the nearest folder with a map', () => {
  const exists = among('/a/content/course.toml', '/a/b/c/content/course.toml');
  assert.equal(courseOf('/a/b/c/content/lessons/1.1-x.md', exists), '/a/b/c');
  assert.equal(courseOf('/a/b', exists), '/a');
  assert.equal(courseOf('/d/e.md', exists), undefined);
});

test('the command is that of the setting, of .venv, of the path', () => {
  const env = { PATH: '/usr/bin:/opt/bin' };
  const find = (setting, ...exists) => commandOf(setting, '/c', { env, platform: 'linux', exists: among(...exists) });
  assert.equal(find('', '/c/.venv/bin/coursebuild', '/opt/bin/coursebuild'), '/c/.venv/bin/coursebuild');
  assert.equal(find('', '/opt/bin/coursebuild'), '/opt/bin/coursebuild');
  assert.equal(find(''), undefined);
  assert.equal(find('tools/coursebuild'), '/c/tools/coursebuild');
  assert.equal(find('/x/coursebuild'), '/x/coursebuild');
  assert.equal(find('coursebuild-dev'), 'coursebuild-dev');
  const windows = { env: {}, platform: 'win32', exists: among('C:\\c\\.venv\\Scripts\\coursebuild.exe') };
  assert.equal(commandOf('', 'C:\\c', windows), 'C:\\c\\.venv\\Scripts\\coursebuild.exe');
});

test('no place on the path is meant from the working folder', () => {
  const exists = among('coursebuild', './coursebuild', 'bin/coursebuild', '/opt/bin/coursebuild');
  const env = { PATH: '.:bin::/opt/bin' };
  assert.equal(commandOf('', '/c', { env, platform: 'linux', exists }), '/opt/bin/coursebuild');
});

test('a file has the page that the map says', () => {
  const map = `[course]\ntitle = "T"\n\n[[page]] # first\nid = "home"\nfile = "content/pages/home.md"\n
[[page]]\nfile = 'docs/a/text.md'\nid = "text"\n[[level]]\nid = "1"\n`;
  assert.equal(pageOf('content/lessons/1.1-fälle.md', map), 'lessons/1.1-f%C3%A4lle.html');
  assert.equal(pageOf('docs/a/text.md', map), 'text.html');
  assert.equal(pageOf('content/pages/home.md', map), '');
  assert.equal(pageOf('README.md', map), '');
});

test('the address of the preview is the one that it says', () => {
  const address = 'http://127.0.0.1:43127/?token=0a1b';
  assert.equal(addressIn(`serving ${address} (stop with Ctrl-C)\n`), address);
  assert.equal(addressIn('reading the course'), undefined);
});
