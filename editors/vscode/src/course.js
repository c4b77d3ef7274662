// Functions about a course that need no editor: where its command is, which page shows a file.

const fs = require('node:fs');
const path = require('node:path');

/** The nearest folder of a course, from a file or folder upwards, or undefined. */
function courseOf(place, exists = fs.existsSync) {
  for (let folder = place; ; folder = path.dirname(folder)) {
    if (exists(path.join(folder, 'content', 'course.toml'))) return folder;
    if (folder === path.dirname(folder)) return undefined;
  }
}

/** The command of a course, or undefined. A setting is used without checking that the file exists. */
function commandOf(setting, folder, { env = process.env, platform = process.platform, exists = fs.existsSync } = {}) {
  const { join, isAbsolute, delimiter } = platform === 'win32' ? path.win32 : path.posix;
  const [bin, name] = platform === 'win32' ? ['Scripts', 'coursebuild.exe'] : ['bin', 'coursebuild'];
  if (setting) {
    if (!/[\\/]/.test(setting)) return setting;
    return isAbsolute(setting) ? setting : join(folder, setting);
  }
  const pathFolders = (env.PATH ?? '').split(delimiter).filter(isAbsolute);
  return [join(folder, '.venv', bin), ...pathFolders].map((location) => join(location, name)).find(exists);
}

/** The address of the page that shows a file of the course, relative to the site. */
function pageOf(file, map) {
  const lesson = /^content\/lessons\/([^/]+)\.md$/.exec(file);
  if (lesson) return `lessons/${encodeURIComponent(lesson[1])}.html`;
  for (const table of map.split(/^\s*\[\[?/m).filter((text) => text.startsWith('page]]'))) {
    const value = (key) => new RegExp(`^\\s*${key}\\s*=\\s*["']([^"']*)["']`, 'm').exec(table)?.[1];
    if (value('file') === file) return value('id') === 'home' ? '' : `${value('id')}.html`;
  }
  return '';
}

/** The address of the preview, with its token, in the text that it prints, or undefined. */
function addressIn(text) {
  return /serving (http:\/\/\S+)/.exec(text)?.[1];
}

module.exports = { courseOf, commandOf, pageOf, addressIn };
