polypic_test(transfer LABEL fast LINK polypic_sim)
polypic_test(liquid LABEL fast LINK polypic_sim)
polypic_test(checkpoint LABEL fast LINK polypic_sim)
polypic_test(taylor_green LABEL fast LINK polypic_sim)
