"""A Numba pipeline for functions that are only ever merged into others: they are lowered, and that is all.

Numba optimises each function that compiled code calls, and makes machine code of it, though here all of them are merged
into a few entry points, which are optimised as a whole: that was almost half of the time of a cold start.
"""

from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import _dynfunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class Code(JITCodeLibrary):  # type: ignore[misc]
    """Code for merging, which the engine that makes machine code never sees."""

    def object_code(self, symbol: str, entry: ir.Module) -> bytes:
        """Machine code of everything in here that `symbol`, a function of the module `entry`, needs."""
        with global_compiler_lock:
            self._ensure_finalized()
        module = self._final_module
        module.link_in(llvmlite.binding.parse_assembly(str(entry)))
        for part in (*module.functions, *module.global_variables):
            if not part.is_declaration and part.name != symbol:
                part.linkage = "internal"
        super()._optimize_final_module()
        module.verify()
        return bytes(self._codegen._tm.emit_object(module))

    def _optimize_final_module(self) -> None:
        """Whoever it is merged into optimises it."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOnly(NativeLowering):  # type: ignore[misc]
    _name = "lowering_only"

    def run_pass(self, state: Any) -> bool:
        state.library = Code(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        described = lowered.fndesc
        # By what it would be called from Python, compiled code finds it; nothing ever calls it so.
        key = _dynfunc.make_function(
            described.lookup_module(), described.qualname, "", 0, lowered.env, (state.library,)
        )
        state.targetctx.insert_user_function(key, described, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return True


class Merged(CompilerBase):  # type: ignore[misc]
    """The pipeline: `njit(pipeline_class=Merged)`."""

    def define_pipelines(self) -> list[Any]:
        """Numba's own, but for its end."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.passes = [
            (_LoweringOnly if kind is NativeLowering else kind, why) for kind, why in manager.passes
        ]
        manager.finalize()
        return [manager]
