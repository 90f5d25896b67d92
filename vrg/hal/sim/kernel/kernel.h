/* What the files of the kernel share: the arguments of its functions, and the portable cosine and sine.

The kernel computes what the modules of vrg.hal.sim compute with numpy, and gives the same bits: each sum and product is
that of the Python code, in its order, and is rounded to a double. So it must be compiled with -ffp-contract=off. */

#ifndef VRG_KERNEL_H
#define VRG_KERNEL_H

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>
#include <float.h>
#include <math.h>
#include <string.h>

#if FLT_EVAL_METHOD != 0 || defined(__FAST_MATH__)
#error "expected a compiler that rounds every operation to a double"
#endif

#define MOST 16
#define TAU 6.283185307179586

/* The arguments of a call: of each its number or the first of its array, and how many there are in the array. */
typedef struct {
    double number[MOST];
    double *array[MOST];
    unsigned char *flags[MOST];
    Py_ssize_t *rows[MOST];
    Py_ssize_t size[MOST];
    Py_buffer views[MOST];
    int held;
} Arguments;

/* Take in arguments: `d` a number, `a` an array of doubles, `f` one of bool, `i` one of intp; an upper-case letter is an
array that is written. All arrays are contiguous. Return 0, with an exception and nothing held, if one is something else.
*/
int take(Arguments *to, const char *kinds, PyObject *const *given, Py_ssize_t count);

/* Check the sizes of the arrays; -1 stands for any. Release all and return 0, with an exception, if one is another. */
int fits(Arguments *these, const Py_ssize_t *sizes);

void release(Arguments *these);

/* vrg.portable.scalars.cos_sin; NaN of an infinite angle. */
static inline void cos_sin(double angle, double *cosine, double *sine)
{
    if (!(fabs(angle) <= 0x1p20))
        angle = fmod(angle, TAU);
    if (angle != angle) {
        *cosine = *sine = angle;
        return;
    }
    const double whole = 0x1.8p52;
    double quarters = angle * 6.36619772367581382433e-01 + whole - whole;
    double rest = angle - quarters * 1.57079632673412561417e00, less = quarters * 6.07710050630396597660e-11;
    double near = rest - less;
    less = quarters * 2.02226624879595063154e-21 - ((rest - near) - less);
    double x = near - less;
    double tail = (near - x) - less;
    double z = x * x;
    double half = 0.5 * z;
    double s = x + (z * x * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))))) + tail);
    double small = z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03
        + z * (2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07
        + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))))) - x * tail;
    double one = 1.0 - half;
    double c = one + (((1.0 - one) - half) + small);
    switch ((int)quarters & 3) {
    case 0: *cosine = c, *sine = s; break;
    case 1: *cosine = -s, *sine = c; break;
    case 2: *cosine = -c, *sine = -s; break;
    default: *cosine = s, *sine = -c;
    }
}

/* The lesser and the greater of two numbers, of which none is NaN. */
static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return b > a ? b : a; }

/* numpy's hypot of vrg.portable.arrays. */
static inline double length(double x, double y) { return sqrt(x * x + y * y); }

/* Wrap the headings of poses, of which each has three numbers, if one of them is out of [-pi, pi]. */
static inline void wrap_all(double *poses, Py_ssize_t robots)
{
    int out = 0;
    for (Py_ssize_t i = 0; i < robots; i++)
        out |= fabs(poses[3 * i + 2]) > TAU / 2;
    for (Py_ssize_t i = 0; out && i < robots; i++)
        poses[3 * i + 2] -= rint(poses[3 * i + 2] / TAU) * TAU;
}

/* The functions of Python; the stub _kernel.pyi says what they take. */
#define FUNCTIONS(one) \
    one(accelerate) one(advance) one(candidates) one(press) one(depart) one(settle) one(arrive) \
    one(integrate) one(outlines) one(cast_edges) one(cone_edges)
#define DECLARED(name) PyObject *name(PyObject *module, PyObject *const *args, Py_ssize_t count);
FUNCTIONS(DECLARED)

#endif
