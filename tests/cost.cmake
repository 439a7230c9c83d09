# What accuracy costs: problems with known answers, and the engine around them.
polypic_test(cost_problems LABEL slow LINK polypic_app)
polypic_test(cost_report LABEL fast LINK polypic_app)
