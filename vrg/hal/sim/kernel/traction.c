/* The traction of wheels of vrg.hal.sim.engines.traction, and what stands around MuJoCo's physics steps. */

#include "kernel.h"

static double sign(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }

PyObject *press(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { DT, GIVE, DRIVE, COS, SIN, VELOCITIES, RIMS, WAYS, DAMPED, GRIPS, STRETCHES, FORCES };
    Arguments a;
    if (!take(&a, "dddaaaaaaaAA", args, count))
        return NULL;
    Py_ssize_t n = a.size[COS], wheels = n ? a.size[RIMS] / n : 0, all = wheels * n;
    if (!fits(&a, (const Py_ssize_t[]){-1, -1, -1, n, n, 3 * n, all, 6 * all, n, n, 2 * all, 3 * n, -2}))
        return NULL;
    double dt = a.number[DT], give = a.number[GIVE], drive = a.number[DRIVE];
    const double *ways = a.array[WAYS];
    for (Py_ssize_t i = 0; i < n; i++) {
        const double *velocity = a.array[VELOCITIES] + 3 * i;
        double cos = a.array[COS][i], sin = a.array[SIN][i], damped = -a.array[DAMPED][i], sums[3] = {0.0, 0.0, 0.0};
        double ahead = velocity[0] * cos + velocity[1] * sin, aside = velocity[1] * cos - velocity[0] * sin;
        for (Py_ssize_t k = 0; k < wheels; k++) {
            Py_ssize_t at = k * n + i;
            double rim = a.array[RIMS][at], turning = sign(rim), slips[2], pushes[2];
            for (int side = 0; side < 2; side++) {
                const double *way = ways + side * all + at;
                slips[side] = way[0] * ahead + way[2 * all] * aside + way[4 * all] * velocity[2];
            }
            int rolling = slips[0] * turning > 0.0;
            slips[0] -= rim;
            for (int side = 0; side < 2; side++) {
                double *stretch = a.array[STRETCHES] + side * all + at;
                *stretch += slips[side] * (dt / give);
                slips[side] /= damped;
                pushes[side] = slips[side] - *stretch;
            }
            double size = length(pushes[0], pushes[1]);
            pushes[0] /= most(size, 1.0);
            pushes[1] /= most(size, 1.0);
            int driven = rolling && pushes[0] * turning > drive;
            if (driven)
                pushes[0] = turning * drive;
            if (driven || size > 1.0) {
                double spring_share = least(0.0, length(slips[0], slips[1]) - 1.0);
                for (int side = 0; side < 2; side++)
                    a.array[STRETCHES][side * all + at] = pushes[side] * spring_share;
            }
            for (int j = 0; j < 3; j++) {
                double part = ways[2 * j * all + at] * pushes[0] + ways[(2 * j + 1) * all + at] * pushes[1];
                sums[j] = k ? sums[j] + part : part;
            }
        }
        for (int j = 0; j < 3; j++)
            sums[j] *= a.array[GRIPS][i];
        double *force = a.array[FORCES] + 3 * i;
        force[0] = sums[0] * cos - sums[1] * sin;
        force[1] = sums[0] * sin + sums[1] * cos;
        force[2] = sums[2];
    }
    release(&a);
    Py_RETURN_NONE;
}

/* The arrays of MujocoEngine with which `depart`, `settle` and `arrive` begin. */
enum { PLACES, SPEEDS, ZEROS, FRAMES, COS_OF, SIN_OF, MORE };

/* Turn the frames of the bodies whose headings have changed; see MujocoEngine._settle. */
static void turn(const Arguments *a)
{
    double *places = a->array[PLACES], *zeros = a->array[ZEROS];
    for (Py_ssize_t i = 0; i < a->size[COS_OF]; i++) {
        double heading = places[3 * i + 2], cos, sin;
        if (heading == zeros[3 * i + 2])
            continue;
        cos_sin(heading * 0.5, &cos, &sin);
        zeros[3 * i + 2] = heading;
        a->array[FRAMES][4 * i] = cos;
        a->array[FRAMES][4 * i + 3] = sin;
        a->array[COS_OF][i] = cos * cos - sin * sin;
        a->array[SIN_OF][i] = 2.0 * cos * sin;
    }
}

PyObject *depart(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { POSES = MORE, VELOCITIES };
    Arguments a;
    if (!take(&a, "AAAAAAaa", args, count))
        return NULL;
    Py_ssize_t n = a.size[COS_OF];
    if (!fits(&a, (const Py_ssize_t[]){3 * n, 3 * n, 3 * n, 4 * n, n, n, 3 * n, 3 * n, -2}))
        return NULL;
    memcpy(a.array[PLACES], a.array[POSES], (size_t)n * 3 * sizeof(double));
    turn(&a);
    for (Py_ssize_t i = 0; i < n; i++) {
        const double *velocity = a.array[VELOCITIES] + 3 * i;
        double cos = a.array[COS_OF][i], sin = a.array[SIN_OF][i], *speed = a.array[SPEEDS] + 3 * i;
        speed[0] = velocity[0] * cos - velocity[2] * sin;
        speed[1] = velocity[0] * sin + velocity[2] * cos;
        speed[2] = velocity[1];
    }
    release(&a);
    Py_RETURN_NONE;
}

PyObject *settle(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { BOUND = MORE };
    Arguments a;
    if (!take(&a, "AAAAAAa", args, count))
        return NULL;
    Py_ssize_t n = a.size[COS_OF];
    if (!fits(&a, (const Py_ssize_t[]){3 * n, 3 * n, 3 * n, 4 * n, n, n, 3, -2}))
        return NULL;
    for (Py_ssize_t i = 0; i < 3 * n; i++) {
        double bound = a.array[BOUND][i % 3], *speed = a.array[SPEEDS] + i;
        *speed = least(most(*speed, -bound), bound);
    }
    turn(&a);
    release(&a);
    Py_RETURN_NONE;
}

PyObject *arrive(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { KINEMATIC = MORE, POSES, VELOCITIES };
    Arguments a;
    if (!take(&a, "AAAAAAfAA", args, count))
        return NULL;
    Py_ssize_t n = a.size[COS_OF];
    if (!fits(&a, (const Py_ssize_t[]){3 * n, 3 * n, 3 * n, 4 * n, n, n, n, 3 * n, 3 * n, -2}))
        return NULL;
    for (Py_ssize_t i = 0; i < n; i++) {
        double *place = a.array[PLACES] + 3 * i, *velocity = a.array[VELOCITIES] + 3 * i;
        const double *speed = a.array[SPEEDS] + 3 * i;
        double cos = a.array[COS_OF][i], sin = a.array[SIN_OF][i];
        place[2] -= rint(place[2] / TAU) * TAU;
        if (a.flags[KINEMATIC][i])
            continue;
        memcpy(a.array[POSES] + 3 * i, place, 3 * sizeof(double));
        velocity[0] = speed[0] * cos + speed[1] * sin;
        velocity[1] = speed[2];
        velocity[2] = speed[1] * cos - speed[0] * sin;
    }
    release(&a);
    Py_RETURN_NONE;
}
