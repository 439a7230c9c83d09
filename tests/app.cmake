polypic_test(shot LABEL fast LINK polypic_app)
polypic_test(shot_errors LABEL fast LINK polypic_app)
