"""A CubeSat finds Space Rider in its camera, flies up to it and stops 20 m behind it.

Two processes: this one flies, the image server draws. Per frame:

    camera (image server)  ->  DN image
    vision                 ->  wing tips in the image, from them range and line of sight
    navigation             ->  Kalman filter of the relative state, Clohessy-Wiltshire dynamics
    guidance               ->  every half minute a velocity change towards the hold point
    spacecraft             ->  where both craft really go: the truth that only the camera sees

Frames and signs are those of simgl: LVLH has z to nadir, y along minus the orbit normal, x along
the velocity; camera axes are x right, y down, z along the boresight. SI units and radians.
"""
