"""Scores and tables of results, made of the functions of `metrics`.

`scores` is the door: a result folder and a reference in, a `table` out. What motions are compared on is a
`comparison`; `accuracy` and `plausibility` score joints, `geometry` a body's own primitives
(`configurations`), `forces`, `pushes` and `plates` the contact forces, by `parts` of the body, `items` what a
scene bears (`loads`, `rises`). `simulated` and `fitted` read what is scored.
"""
