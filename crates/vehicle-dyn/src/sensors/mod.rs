//! What a sensor makes of a measured quantity: noise, bias, delay, quantisation, drop-outs.
