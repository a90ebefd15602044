"""A CubeSat docks with Space Rider by what its camera shows, from 120 m into an eclipse.

Two processes: this one flies, the image server draws. Every few seconds:

    camera (image server)  ->  DN image of exactly the state that was sent, at its own time
    DelayLine              ->  the image, when read-out and transport are over
    silhouette, markers    ->  far: wing tips before a dark sky; near: discs on a white board
    pose                   ->  line of sight and range, or all six degrees of freedom
    navigation             ->  extended Kalman filter that goes back to the image's own time
    exposure               ->  exposure and lamp, by the brightness that images show
    guidance               ->  pushes: a glideslope up to 15 m, another down the board's axis
    spacecraft, attitude   ->  where both craft really go: the truth that only the camera sees

``pilot`` is the flight software and never sees the truth, ``loop`` ties it to the world, ``report``
and ``monte_carlo`` write down what happened. Frames and signs are those of simgl: LVLH has z to
nadir, y along minus the orbit normal, x along the velocity; camera axes are x right, y down, z
along the boresight. SI units and radians.
"""
