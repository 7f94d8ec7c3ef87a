"""Proofs: claims of the docs, each tried on many inputs that are made at random.

A proof is a module of this folder. It has:

    __doc__: the claim, whose first line is shown in the list of proofs.
    COUNT: the number of inputs of the whole proof.
    prove(count, seed): tries the claim on `count` inputs, which follow from the seed, and prints what it finds. It returns the
        number of inputs that break the claim.
"""
