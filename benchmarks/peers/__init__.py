"""Other people's packages on the same loops, each as well set as it can be; they give x and υ, and no more."""
