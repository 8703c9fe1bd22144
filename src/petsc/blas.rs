//! Which kernels OpenBLAS uses (<https://github.com/OpenMathLib/OpenBLAS/blob/develop/USAGE.md>).

use super::raw;
use std::{
    env,
    ffi::{CStr, c_char},
    mem::transmute,
    ptr,
};

/// What names the kernels that OpenBLAS is to use; a user's choice stays.
const CORE_TYPE: &str = "OPENBLAS_CORETYPE";

/// Lets OpenBLAS choose by what the processor can do, where it has taken its oldest kernels because it does
/// not know the model: on such a one Debian's multiplied matrices at a fifth of the speed, and a
/// factorisation with 132,000 unknowns took 1.4 times as long. Another BLAS is left as it is.
///
/// # Safety
/// Nothing uses BLAS meanwhile, or reads the environment but through std.
pub(super) unsafe fn choose_kernels() {
    let Some(best) = best_kernels().filter(|_| env::var_os(CORE_TYPE).is_none()) else { return };
    // SAFETY: the functions are those of OpenBLAS, if it has them, with their types there: what it calls
    // itself when it is loaded and unloaded. Its name is a static string.
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

/// OpenBLAS' name of the kernels for what this processor can do, if that is more than its oldest need.
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
