/** The course map and the pages of levels: marks of what is read. A script of its own, which only these pages load. */

import { showMap } from './progress/map.js'

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: showMap }))
