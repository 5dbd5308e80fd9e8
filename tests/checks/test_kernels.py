"""Compiled loops are called by their own package, which wraps them for others, and by other loops.

A loop can call nothing but loops, so those of another package are no detour around its wrapper. import-linter
has no contract in which each module of a pattern has importers of its own.
"""

import grimp

SHARED = ("racecar.maps.geometry",)
"""Poses, with which every room reckons."""
EXCEPTIONS = {"benchmarks.ablation.mechanisms"}
"""It replaces what it turns off."""


def package_of(module: str) -> str:
    return module.rpartition(".")[0]


def test_kernels_are_imported_by_their_own_package_only() -> None:
    graph = grimp.build_graph("racecar", "benchmarks", cache_dir=None)
    imports = [
        (importing, kernels)
        for kernels in graph.modules
        if kernels.endswith("_kernels")
        for importing in graph.find_modules_that_directly_import(kernels)
        if not importing.endswith("_kernels") and importing not in EXCEPTIONS
    ]
    assert len(imports) > 10
    assert [
        f"{importing} imports {kernels}"
        for importing, kernels in imports
        if package_of(kernels) not in (*SHARED, package_of(importing))
    ] == []
