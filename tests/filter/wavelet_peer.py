"""PyWavelets as the independent party: each line is `wavelet mode levels samples...`; answers, for each, the flat
coefficients (approximation first, then coarsest to finest) and the reconstruction."""
import sys

import numpy as np
import pywt


def words(values):
    return " ".join(repr(float(v)) for v in values)


for line in open(sys.argv[1]):
    wavelet, mode, levels, *samples = line.split()
    coefficients = pywt.wavedec(np.array(samples, float), wavelet, mode=mode, level=int(levels))
    print(words(np.concatenate(coefficients)))
    print(words(pywt.waverec(coefficients, wavelet, mode=mode)))
