/** Marks what is read on the course map and the pages of levels. A separate script, which only these pages load. */

import { showMap } from './progress/map.js'

document.dispatchEvent(new CustomEvent('coursebuild:reader', { detail: showMap }))
