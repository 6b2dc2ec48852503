"""Industrial cameras for rig: GigE Vision and USB3 Vision by GenICam."""
