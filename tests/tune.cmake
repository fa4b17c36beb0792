# Fits of parameters to the truth.
cranny_test(tune LAYERS compare screen TIMEOUT 120)
