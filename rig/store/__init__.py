"""The operator's verbs: what is stored is checked, copied, brought back, thinned out and moved."""
