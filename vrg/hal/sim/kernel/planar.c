/* The motion of vrg.hal.sim.engines.planar, and what is near enough to touch. */

#include "kernel.h"

/* Move the speeds of the axes of a robot towards their targets, as Engine._accelerate does. */
static void towards(double dt, const double *targets, double *speeds, double slew, double slowing, int holonomic,
    Py_ssize_t axes)
{
    double share = 1.0;
    if (holonomic)
        for (Py_ssize_t k = 0; k < axes; k++) {
            double change = targets[k] - speeds[k];
            double limit = (change * speeds[k] < 0.0 ? slowing : slew) * dt;
            share = least(share, limit / most(fabs(change), 1e-12));
        }
    for (Py_ssize_t k = 0; k < axes; k++) {
        double change = targets[k] - speeds[k];
        double limit = (change * speeds[k] < 0.0 ? slowing : slew) * dt;
        if (holonomic)
            change *= share;
        speeds[k] = most(least(change, limit), -limit) + speeds[k];
    }
}

PyObject *accelerate(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { DT, TARGETS, SPEEDS, SLEW, SLOWING, SIDEWAYS };
    Arguments a;
    if (!take(&a, "daAaaf", args, count))
        return NULL;
    Py_ssize_t robots = a.size[SLEW], axes = robots ? a.size[SPEEDS] / robots : 0;
    if (!fits(&a, (const Py_ssize_t[]){-1, robots * axes, robots * axes, robots, robots, robots, -2}))
        return NULL;
    for (Py_ssize_t i = 0; i < robots; i++)
        towards(a.number[DT], a.array[TARGETS] + i * axes, a.array[SPEEDS] + i * axes, a.array[SLEW][i],
            a.array[SLOWING][i], a.flags[SIDEWAYS][i], axes);
    release(&a);
    Py_RETURN_NONE;
}

PyObject *advance(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { DT, TARGETS, SPEEDS, SLEW, SLOWING, SIDEWAYS, MOTIONS, REACH, VELOCITIES, POSES, ANGLES, BUDGETS };
    Arguments a;
    if (!take(&a, "daAaafaaAAAA", args, count))
        return NULL;
    Py_ssize_t n = a.size[SLEW], axes = n ? a.size[SPEEDS] / n : 0;
    if (!fits(&a, (const Py_ssize_t[]){-1, n * axes, n * axes, n, n, n, axes * n * 3, n, n * 3, n * 3, n * axes, 2 * n, -2}))
        return NULL;
    double dt = a.number[DT];
    int sideways = 0, used_up = 0;
    for (Py_ssize_t i = 0; i < n; i++)
        sideways |= a.flags[SIDEWAYS][i];
    for (Py_ssize_t i = 0; i < n; i++) {
        double *speeds = a.array[SPEEDS] + i * axes, *velocity = a.array[VELOCITIES] + i * 3;
        double *pose = a.array[POSES] + i * 3, *budgets = a.array[BUDGETS] + i;
        towards(dt, a.array[TARGETS] + i * axes, speeds, a.array[SLEW][i], a.array[SLOWING][i], a.flags[SIDEWAYS][i],
            axes);
        for (Py_ssize_t k = 0; k < axes; k++) {
            const double *motion = a.array[MOTIONS] + (k * n + i) * 3;
            for (int j = 0; j < 3; j++)
                velocity[j] = k ? velocity[j] + motion[j] * speeds[k] : motion[j] * speeds[k];
            a.array[ANGLES][i * axes + k] += speeds[k] * dt;
        }
        double way = velocity[0] * dt, turned = velocity[1] * dt, aside = velocity[2] * dt, cos, sin;
        cos_sin(pose[2] + turned * 0.5, &cos, &sin);
        pose[0] += way * cos;
        pose[1] += way * sin;
        double far = fabs(way) + fabs(turned) * a.array[REACH][i];
        if (sideways) {
            pose[0] -= aside * sin;
            pose[1] += aside * cos;
            far += fabs(aside);
        }
        pose[2] += turned;
        budgets[0] -= far;
        budgets[n] -= far;
        used_up |= budgets[0] < 0.0 || budgets[n] < 0.0;
    }
    if (!used_up)  /* otherwise they are wrapped when contacts are resolved */
        wrap_all(a.array[POSES], n);
    release(&a);
    return PyBool_FromLong(used_up);
}

/* The data of a world of the planar engine by which `candidates` finds what is near. */
typedef struct {
    Py_ssize_t robots, boxes, discs;
    const double *poses, *reach, *at, *half, *cos, *sin, *round;
    const unsigned char *kinematic;
} World;

/* The gap between the circles around two robots, m; infinite between kinematic ones and for one robot. */
static double between(const World *w, Py_ssize_t i, Py_ssize_t j)
{
    if (i == j || (w->kinematic[i] && w->kinematic[j]))
        return INFINITY;
    double x = w->poses[3 * j] - w->poses[3 * i], y = w->poses[3 * j + 1] - w->poses[3 * i + 1];
    return length(x, y) - (w->reach[j] + w->reach[i]);
}

/* The gap between the circle around a robot and a wall or obstacle, m. */
static double to_static(const World *w, Py_ssize_t i, Py_ssize_t k)
{
    double x = w->poses[3 * i], y = w->poses[3 * i + 1];
    if (k >= w->boxes) {
        const double *disc = w->round + 3 * (k - w->boxes);
        return length(x - disc[0], y - disc[1]) - disc[2] - w->reach[i];
    }
    double dx = x - w->at[2 * k], dy = y - w->at[2 * k + 1];
    double u = fabs(dx * w->cos[k] + dy * w->sin[k]) - w->half[2 * k];
    double v = fabs(dy * w->cos[k] - dx * w->sin[k]) - w->half[2 * k + 1];
    return length(most(u, 0.0), most(v, 0.0)) - w->reach[i];
}

/* Append a pair of numbers to a list; 0 if that fails. */
static int append(PyObject *list, Py_ssize_t first, Py_ssize_t second)
{
    PyObject *pair = Py_BuildValue("(nn)", first, second);
    int good = pair != NULL && PyList_Append(list, pair) == 0;
    Py_XDECREF(pair);
    return good;
}

PyObject *candidates(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { MARGIN, PUSH, POSES, REACH, KINEMATIC, AT, HALF, COS, SIN, DISCS, BUDGETS, CHECKED };
    Arguments a;
    if (!take(&a, "ddaafaaaaaAF", args, count))
        return NULL;
    Py_ssize_t n = a.size[REACH], boxes = a.size[COS], discs = a.size[DISCS] / 3;
    if (!fits(&a, (const Py_ssize_t[]){
            -1, -1, 3 * n, n, n, 2 * boxes, 2 * boxes, boxes, boxes, 3 * discs, 2 * n, 2 * n, -2}))
        return NULL;
    const World w = {n, boxes, discs, a.array[POSES], a.array[REACH], a.array[AT], a.array[HALF], a.array[COS],
        a.array[SIN], a.array[DISCS], a.flags[KINEMATIC]};
    double margin = a.number[MARGIN], *of_walls = a.array[BUDGETS], *of_robots = of_walls + n;
    unsigned char *at_walls = a.flags[CHECKED], *checked = at_walls + n;
    PyObject *walls = PyList_New(0), *pairs = PyList_New(0), *both = NULL;
    double *own = PyMem_Malloc((size_t)n * sizeof(double) + 1);
    unsigned char *wave = PyMem_Calloc((size_t)n + 1, 1);  /* bit 0: its turn is now; bit 1: it is in the next wave */
    int good = walls && pairs && own && wave, waiting = 0;
    for (Py_ssize_t i = 0; good && i < n; i++) {
        at_walls[i] = of_walls[i] < 0.0;
        wave[i] = checked[i] = of_robots[i] < 0.0;
        waiting |= wave[i];
    }
    while (good && waiting) {
        /* The budgets of the others fall first, then those whose turn it is get their own: the order does not matter. */
        for (Py_ssize_t i = 0; i < n; i++) {
            if (!(wave[i] & 1))
                continue;
            own[i] = INFINITY;
            for (Py_ssize_t j = 0; j < n; j++) {
                double gap = between(&w, i, j), half = most(gap, 0.0) / 2;
                own[i] = least(own[i], half);
                of_robots[j] = least(of_robots[j], half);
                if (gap < margin && !checked[j])
                    wave[j] |= 2;
            }
        }
        waiting = 0;
        for (Py_ssize_t i = 0; i < n; i++) {
            if (wave[i] & 1)
                of_robots[i] = own[i];
            wave[i] >>= 1;
            checked[i] |= wave[i];
            waiting |= wave[i];
        }
    }
    for (Py_ssize_t i = 0; good && i < n; i++)
        for (Py_ssize_t j = i + 1; good && j < n; j++)
            if ((checked[i] || checked[j]) && between(&w, i, j) < margin) {
                good = append(pairs, i, j);
                at_walls[i] |= of_walls[i] < a.number[PUSH];
                at_walls[j] |= of_walls[j] < a.number[PUSH];
            }
    for (Py_ssize_t i = 0; good && i < n; i++) {
        if (!at_walls[i])
            continue;
        double nearest = INFINITY;
        for (Py_ssize_t k = 0; good && k < boxes + discs; k++) {
            double gap = to_static(&w, i, k);
            nearest = least(nearest, gap);
            if (gap < margin)
                good = append(walls, i, k);
        }
        of_walls[i] = most(nearest, 0.0);
    }
    if (good)
        both = PyTuple_Pack(2, walls, pairs);
    else if (!PyErr_Occurred())
        PyErr_NoMemory();
    Py_XDECREF(walls);
    Py_XDECREF(pairs);
    PyMem_Free(own);
    PyMem_Free(wave);
    release(&a);
    return both;
}
