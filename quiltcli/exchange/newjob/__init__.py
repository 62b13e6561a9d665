"""New jobs from tape-measure figures: display, layout, scene, job, and a plan with dimensions."""
