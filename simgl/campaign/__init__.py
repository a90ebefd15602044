"""Randomised frames of one scenario, rendered in parallel, with labels for training.

``campaign_schema``  every table and key of a campaign file
``campaign_file``    from a campaign file to a ``Campaign``
``random_draws``     random values by seed, name and frame; the distributions
``frame_scene``      the scene of a frame
``frame_task``       a frame's files and row, as a job for workers
``labels``           pose, box, keypoints and mask of each spacecraft in a frame
``label_formats``    the labels of all frames as COCO and SPEED+ files
``bop_format``       a data set of BOP: depth, silhouettes, tables, models
``pose_formats``     COLMAP, nerfstudio and YOLO
``truth_maps``       depth and normals for COLMAP and nerfstudio
``webdataset_format``  shards of WebDataset
``stream``           frames without files; ``torch_dataset`` as a data set of PyTorch
``data_sets``        which of these are written; what they cannot hold
``run_campaign``     the run, which can be resumed

May import the simulator, ``output``, ``workers`` and ``sequence``. A new random value is a key in
``campaign_schema.DrawTable``, its limits in ``campaign_file``, and its use in ``frame_scene``.
"""
