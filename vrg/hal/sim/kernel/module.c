/* The module vrg.hal.sim._kernel: its table of functions, and their arguments. */

#include "kernel.h"

void release(Arguments *these)
{
    while (these->held > 0)
        PyBuffer_Release(&these->views[--these->held]);
}

int take(Arguments *to, const char *kinds, PyObject *const *given, Py_ssize_t count)
{
    to->held = 0;
    if (count != (Py_ssize_t)strlen(kinds)) {
        PyErr_Format(PyExc_TypeError, "expected %zd arguments, got %zd", (Py_ssize_t)strlen(kinds), count);
        return 0;
    }
    for (Py_ssize_t n = 0; n < count; n++) {
        char kind = kinds[n];
        if (kind == 'd') {
            to->number[n] = PyFloat_AsDouble(given[n]);
            to->size[n] = -1;
            if (to->number[n] == -1.0 && PyErr_Occurred())
                goto failed;
            continue;
        }
        Py_buffer *view = &to->views[to->held];
        int written = kind < 'a';
        char wanted = kind | 0x20;
        if (PyObject_GetBuffer(given[n], view, PyBUF_FORMAT | PyBUF_ND | (written ? PyBUF_WRITABLE : 0)) < 0)
            goto failed;
        to->held++;
        const char *format = view->format ? view->format : "";
        int right = wanted == 'a' ? !strcmp(format, "d") : wanted == 'f' ? !strcmp(format, "?")
            : view->itemsize == sizeof(Py_ssize_t) && strchr("lqn", *format) && *format;
        if (!right) {
            PyErr_Format(PyExc_TypeError, "argument %zd: expected an array of %s, got the format %s", n + 1,
                wanted == 'a' ? "float64" : wanted == 'f' ? "bool" : "intp", format);
            goto failed;
        }
        to->array[n] = view->buf;
        to->flags[n] = view->buf;
        to->rows[n] = view->buf;
        to->size[n] = view->len / view->itemsize;
    }
    return 1;
failed:
    release(to);
    return 0;
}

int fits(Arguments *these, const Py_ssize_t *sizes)
{
    for (int n = 0; sizes[n] != -2; n++)
        if (sizes[n] != -1 && sizes[n] != these->size[n]) {
            PyErr_Format(PyExc_ValueError, "argument %d: expected %zd values, got %zd", n + 1, sizes[n], these->size[n]);
            release(these);
            return 0;
        }
    return 1;
}

#define ENTRY(name) {#name, (PyCFunction)(void (*)(void))name, METH_FASTCALL, NULL},

static PyMethodDef functions[] = {FUNCTIONS(ENTRY) {NULL, NULL, 0, NULL}};

static PyModuleDef_Slot slots[] = {{0, NULL}};

static PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "_kernel", "The inner arithmetic of the simulation, compiled.", 0, functions, slots,
    NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit__kernel(void) { return PyModuleDef_Init(&definition); }
