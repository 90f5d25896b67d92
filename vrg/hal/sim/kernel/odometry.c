/* The integration of vrg.hal.sim.sensors.odometry. */

#include "kernel.h"

PyObject *integrate(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { ANGLES, AXES, PER_RAD, TURNED, FACTORS, MOTIONS, STARTS, POSES, MOVED };
    Arguments a;
    if (!take(&a, "aiaaaaiAA", args, count))
        return NULL;
    Py_ssize_t columns = a.size[AXES], sensors = a.size[STARTS];
    Py_ssize_t ticks = columns ? a.size[FACTORS] / columns : 0, all = ticks ? a.size[ANGLES] / (ticks + 1) : 0;
    if (!fits(&a, (const Py_ssize_t[]){
            (ticks + 1) * all, columns, columns, columns, ticks * columns, 3 * columns, sensors, 3 * sensors, 3 * sensors, -2}))
        return NULL;
    for (Py_ssize_t c = 0; c < columns; c++)
        if (a.rows[AXES][c] < 0 || a.rows[AXES][c] >= all) {
            release(&a);
            PyErr_SetString(PyExc_IndexError, "expected axes that the angles have");
            return NULL;
        }
    for (Py_ssize_t s = 0; s < sensors; s++) {
        double *pose = a.array[POSES] + 3 * s, *moved = a.array[MOVED] + 3 * s, others[3] = {0.0, 0.0, 0.0};
        Py_ssize_t first = most(a.rows[STARTS][s], 0), last = s + 1 < sensors ? a.rows[STARTS][s + 1] : columns;
        for (Py_ssize_t t = 0; t < ticks; t++) {
            const double *before = a.array[ANGLES] + t * all, *after = before + all;
            for (Py_ssize_t c = first; c < last && c < columns; c++) {
                Py_ssize_t axis = a.rows[AXES][c];
                double counts = floor(after[axis] * a.array[PER_RAD][c]) - floor(before[axis] * a.array[PER_RAD][c]);
                double way = counts * a.array[TURNED][c] * a.array[FACTORS][t * columns + c];
                /* As np.add.reduceat does: the first, and the sum of the others. */
                double *sum = c == first ? moved : others;
                for (int j = 0; j < 3; j++) {
                    double part = way * a.array[MOTIONS][3 * c + j];
                    sum[j] = c <= first + 1 ? part : sum[j] + part;
                }
            }
            for (int j = 0; last - first > 1 && j < 3; j++)
                moved[j] += others[j];
            double cos, sin;
            cos_sin(pose[2] + moved[1] * 0.5, &cos, &sin);
            pose[0] += moved[0] * cos - moved[2] * sin;
            pose[1] += moved[0] * sin + moved[2] * cos;
            pose[2] += moved[1];
        }
    }
    release(&a);
    Py_RETURN_NONE;
}
