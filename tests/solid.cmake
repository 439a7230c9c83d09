polypic_test(solid_svd LABEL fast LINK polypic_sim)
polypic_test(solid_elasticity LABEL fast LINK polypic_sim)
polypic_test(solid_plasticity LABEL fast LINK polypic_sim)
