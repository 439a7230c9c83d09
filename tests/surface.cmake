polypic_test(surface_points LABEL fast LINK polypic_surface OpenVDB::openvdb)
polypic_test(surface_level_set LABEL fast LINK polypic_surface)
polypic_test(surface_mesh LABEL fast LINK polypic_surface)
polypic_test(surface_parts LABEL fast LINK polypic_surface)
