"""The page of the bar under the view: `bar.js` and `bar.css`, which the studio serves."""
