polypic_test(base_error LABEL fast LINK polypic_base)
polypic_test(base_text LABEL fast LINK polypic_base)
polypic_test(base_files LABEL fast LINK polypic_base)
polypic_test(base_ledger LABEL fast LINK polypic_base)
