# What accuracy costs: problems with known answers, and the engine around them.
polypic_test(fluid_vortex_ring LABEL slow LINK polypic_app)
polypic_test(cost_problems LABEL slow LINK polypic_app)
polypic_test(cost_engine LABEL fast LINK polypic_app nlohmann_json::nlohmann_json)
polypic_test(cost_program STARTS_PROGRAM LABEL slow)
polypic_test(cost_report LABEL fast LINK polypic_app)
