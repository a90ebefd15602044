"""The browser view: a page that shows a scenario, or follows what a server renders.

    ViewSession, or a follower of a server -> Snapshot -> NewestSnapshot -> PageServer -> browsers

``scene_description``  what the 3-D view shows of a state, as plain data
``snapshots``          one instant as it is shown; the newest one, shared by threads
``web_settings``       what the viewers of a scenario chose, and the commands that change it
``view_session``       renders a scenario as its viewers ask for
``web_access``         where the page may be bound, and who may see it
``viewers``            who looks on; the images that they share
``page_handlers``, ``page_server``  HTTP, WebSocket and MJPEG, on a thread; need the package tornado
``page/``              the page itself: HTML, style and scripts; loads nothing from elsewhere

May import the simulator. A new way to show an image is a branch in
``simgl.figures.displays.display`` and an option in ``page/view.js``.
"""
