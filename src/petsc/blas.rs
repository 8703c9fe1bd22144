//! The choice of OpenBLAS kernels (<https://github.com/OpenMathLib/OpenBLAS/blob/develop/USAGE.md>).

use super::raw;
use std::{
    env,
    ffi::{CStr, c_char},
    mem::transmute,
    ptr,
};

/// The environment variable that names the kernels for OpenBLAS. The program respects the user's value.
const CORE_TYPE: &str = "OPENBLAS_CORETYPE";

/// Chooses the kernels of OpenBLAS by the instructions of the processor. If OpenBLAS does not know the model
/// of the processor, it takes its oldest kernels: factorisations are about 1.4 times slower then. Another
/// BLAS library stays as it is.
///
/// # Safety
/// No other thread uses BLAS, or reads the environment except through std.
pub(super) unsafe fn choose_kernels() {
    let Some(best) = best_kernels().filter(|_| env::var_os(CORE_TYPE).is_none()) else { return };
    // SAFETY: the functions are OpenBLAS's own, with their types there; OpenBLAS calls them itself when it is
    // loaded and unloaded. The name of its kernels is a static string.
    unsafe {
        let of = |name: &CStr| raw::dlsym(ptr::null_mut(), name.as_ptr());
        let (name, end) = (of(c"openblas_get_corename"), of(c"gotoblas_dynamic_quit"));
        let begin = of(c"gotoblas_dynamic_init");
        if name.is_null() || end.is_null() || begin.is_null() {
            return;
        }
        let name: extern "C" fn() -> *const c_char = transmute(name);
        if CStr::from_ptr(name()) == c"Prescott" {
            let [end, begin] = [end, begin].map(|f| transmute::<_, extern "C" fn()>(f));
            env::set_var(CORE_TYPE, best);
            end();
            begin();
            env::remove_var(CORE_TYPE);
        }
    }
}

/// OpenBLAS's name of the kernels for this processor; `None` for the oldest ones.
fn best_kernels() -> Option<&'static str> {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        let wide = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512cd")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl");
        return Some(if wide { "SkylakeX" } else { "Haswell" });
    }
    None
}
