"""The studio: a result in the browser, its scene and contacts edited by hand, and run again.

Without a browser (nothing here imports viser): clip, camera, shapes — what is seen; document, placing,
penetration — what is edited; asking, runs, comparing — running again; journal, tab, session — what is kept.
Thin over them, with the extra `studio`: gate and serving, bar (the timeline), stage (the view), panels.
"""
