"""Cryptomatte: hashes, the floats they are taken for, and what files say of them."""

import json

import numpy as np
import pytest

from quiltcli.formats.exr.cryptomatte import attributes, identities, identity_bits, name_hash

# Of mmh3, which wraps the reference implementation.
KNOWN = {
    "": 0,
    "a": 0x3C2569B2,
    "ab": 0x9BBFD75F,
    "abc": 0xB3DD93FA,
    "abcd": 0x43ED676A,
    "hello, world": 0x149BBB7F,
    "Käse": 0x79A8A15A,
    "bunny": 0x13851A76,
}


@pytest.mark.parametrize("name", KNOWN)
def test_names_are_hashed_as_others_hash_them(name):
    assert name_hash(name) == KNOWN[name]


def test_no_name_is_a_float_that_arithmetic_would_change():
    names = [f"object{number}" for number in range(4000)]
    bits = [name_hash(name) for name in names]
    assert any(one >> 23 & 255 in (0, 255) for one in bits), "the test must meet such a hash"
    found = identities(names)
    assert np.isfinite(found).all()
    assert (np.abs(found) >= np.finfo(np.float32).tiny).all()
    assert found.view(np.uint32).tolist() == [identity_bits(name) for name in names]


def test_files_tell_the_layer_and_its_names():
    found = attributes("CryptoObject", ["dragon", "bunny", "dragon"])
    keys = {name.rsplit("/", 1)[0] for name in found}
    assert keys == {f"cryptomatte/{name_hash('CryptoObject'):08x}"[:-1]}
    told = {name.rsplit("/", 1)[1]: value for name, value in found.items()}
    assert told["name"] == "CryptoObject"
    assert told["hash"] == "MurmurHash3_32"
    assert told["conversion"] == "uint32_to_float32"
    assert json.loads(told["manifest"]) == {"bunny": "13851a76", "dragon": "7503c4b0"}
