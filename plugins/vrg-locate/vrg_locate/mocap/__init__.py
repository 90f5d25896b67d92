"""Motion capture systems as sources of fixes: OptiTrack, Vicon, Qualisys, VRPN."""
