/* The beams and cones of vrg.hal.sim.sensors.rays among the edges of outlines. */

#include "kernel.h"

#define EPS 1e-9

/* Edges as those of `Edges`: of each its ends x0 y0 x1 y1, its normal x y, and its offset, in rows of `count`. */
typedef struct {
    const double *ends, *normals, *offsets;
    Py_ssize_t count;
} Edges;

/* The distance of a place from the line of an edge, m; negative behind it. */
static double height_over(const Edges *e, Py_ssize_t k, double x, double y)
{
    return x * e->normals[k] + y * e->normals[e->count + k] - e->offsets[k];
}

PyObject *outlines(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { POSES, SIZES, ENDS, NORMALS, OFFSETS };
    static const double along[] = {1.0, -1.0, -1.0, 1.0}, across[] = {1.0, 1.0, -1.0, -1.0};
    Arguments a;
    if (!take(&a, "aaAAA", args, count))
        return NULL;
    Py_ssize_t robots = a.size[POSES] / 3, all = 4 * robots;
    if (!fits(&a, (const Py_ssize_t[]){3 * robots, 2 * robots, 4 * all, 2 * all, all, -2}))
        return NULL;
    double *ends = a.array[ENDS], *normals = a.array[NORMALS], *offsets = a.array[OFFSETS];
    for (Py_ssize_t i = 0, k = 0; i < robots; i++) {
        const double *pose = a.array[POSES] + 3 * i, *size = a.array[SIZES] + 2 * i;
        double cos, sin, x[4], y[4];
        cos_sin(pose[2], &cos, &sin);
        double ax = cos * size[0] / 2, ay = sin * size[0] / 2, bx = -sin * size[1] / 2, by = cos * size[1] / 2;
        for (int c = 0; c < 4; c++) {
            x[c] = pose[0] + ax * along[c] + bx * across[c];
            y[c] = pose[1] + ay * along[c] + by * across[c];
        }
        for (int c = 0; c < 4; c++, k++) {
            int next = (c + 1) % 4;
            double dx = x[next] - x[c], dy = y[next] - y[c], span = length(dx, dy);
            ends[k] = x[c], ends[all + k] = y[c], ends[2 * all + k] = x[next], ends[3 * all + k] = y[next];
            normals[k] = dy / span, normals[all + k] = -dx / span;
            offsets[k] = normals[k] * x[c] + normals[all + k] * y[c];
        }
    }
    release(&a);
    Py_RETURN_NONE;
}

/* vrg.portable.arrays.turn_order. */
static double turn_order(double x, double y)
{
    double along = y / most(fabs(x) + fabs(y), 1e-300);
    return x >= 0.0 ? along : copysign(2.0, y) - along;
}

/* How many of ascending numbers are below a value, or not above it. */
static Py_ssize_t below(const double *ascending, Py_ssize_t count, double value, int or_equal)
{
    Py_ssize_t low = 0, high = count;
    while (low < high) {
        Py_ssize_t middle = (low + high) / 2;
        if (ascending[middle] < value || (or_equal && ascending[middle] == value))
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* The beams of a range finder. */
typedef struct {
    const double *directions, *order;
    Py_ssize_t count;
} Fan;

/* Raise 1 / range of the beams from one direction to another where a line with this slope is nearer. */
static void sweep(double *inverse, const Fan *fan, double low, double high, double slope_x, double slope_y)
{
    Py_ssize_t stop = below(fan->order, fan->count, high + EPS, 1);
    for (Py_ssize_t b = below(fan->order, fan->count, low - EPS, 0); b < stop; b++)
        inverse[b] = most(inverse[b], slope_x * fan->directions[b] + slope_y * fan->directions[fan->count + b]);
}

PyObject *cast_edges(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { RANGE_MAX, PLACES, TURNS, ENDS, NORMALS, OFFSETS, DIRECTIONS, ORDER, INVERSE };
    Arguments a;
    if (!take(&a, "daaaaaaaA", args, count))
        return NULL;
    Py_ssize_t sensors = a.size[PLACES] / 2, edges = a.size[OFFSETS], beams = a.size[ORDER];
    if (!fits(&a, (const Py_ssize_t[]){
            -1, 2 * sensors, 2 * sensors, 4 * edges, 2 * edges, edges, 2 * beams, beams, sensors * beams, -2}))
        return NULL;
    const Edges e = {a.array[ENDS], a.array[NORMALS], a.array[OFFSETS], edges};
    const Fan fan = {a.array[DIRECTIONS], a.array[ORDER], beams};
    for (Py_ssize_t i = 0; i < sensors; i++) {
        double x = a.array[PLACES][2 * i], y = a.array[PLACES][2 * i + 1];
        double c = a.array[TURNS][i], s = a.array[TURNS][sensors + i], *inverse = a.array[INVERSE] + i * beams;
        for (Py_ssize_t k = 0; k < edges; k++) {
            double height = height_over(&e, k, x, y);
            if (!(height > EPS && height < a.number[RANGE_MAX]))
                continue;
            double nx = e.normals[k] / -height, ny = e.normals[edges + k] / -height;
            double slope_x = c * nx + s * ny, slope_y = c * ny - s * nx;
            double ax = e.ends[k] - x, ay = e.ends[edges + k] - y;
            double bx = e.ends[2 * edges + k] - x, by = e.ends[3 * edges + k] - y;
            double high = turn_order(c * ax + s * ay, c * ay - s * ax), low = turn_order(c * bx + s * by, c * by - s * bx);
            if (high < low) {  /* it crosses the line straight behind, where directions jump */
                sweep(inverse, &fan, -2.0, high, slope_x, slope_y);
                high = 2.0;
            }
            sweep(inverse, &fan, low, high, slope_x, slope_y);
        }
    }
    release(&a);
    Py_RETURN_NONE;
}

/* The distance from a place to an edge within a cone, m; see `_edges`. */
static double in_cone(const Edges *e, Py_ssize_t k, double x, double y, double c, double s, double slope, double stretch)
{
    double x0 = e->ends[k] - x, y0 = e->ends[e->count + k] - y;
    double x1 = e->ends[2 * e->count + k] - x, y1 = e->ends[3 * e->count + k] - y;
    double ax = x0 * c + y0 * s, ay = y0 * c - x0 * s, bx = x1 * c + y1 * s, by = y1 * c - x1 * s;
    double dx = bx - ax, dy = by - ay;
    double foot = least(most(-(ax * dx + ay * dy) / (dx * dx + dy * dy), 0.0), 1.0);
    double px = ax + foot * dx, py = ay + foot * dy, found = fabs(py) <= slope * px ? length(px, py) : INFINITY;
    for (int side = 0; side < 2; side++) {
        double border = side ? -slope : slope, t = (ay - border * ax) / (border * dx - dy), along = ax + t * dx;
        if (t >= 0.0 && t <= 1.0 && along > 0.0)
            found = least(found, along * stretch);
    }
    return found;
}

PyObject *cone_edges(PyObject *module, PyObject *const *args, Py_ssize_t count)
{
    enum { RANGE_MAX, SLOPE, STRETCH, POSES, TURNS, ENDS, NORMALS, OFFSETS, NEAREST };
    Arguments a;
    if (!take(&a, "dddaaaaaA", args, count))
        return NULL;
    Py_ssize_t cones = a.size[NEAREST], edges = a.size[OFFSETS];
    if (!fits(&a, (const Py_ssize_t[]){-1, -1, -1, 3 * cones, 2 * cones, 4 * edges, 2 * edges, edges, cones, -2}))
        return NULL;
    const Edges e = {a.array[ENDS], a.array[NORMALS], a.array[OFFSETS], edges};
    double range_max = a.number[RANGE_MAX];
    for (Py_ssize_t i = 0; i < cones; i++) {
        double x = a.array[POSES][3 * i], y = a.array[POSES][3 * i + 1];
        for (Py_ssize_t k = 0; k < edges; k++) {
            double height = height_over(&e, k, x, y);
            if (!(height > EPS && height < range_max))
                continue;
            const double *x0 = e.ends + k, *y0 = x0 + edges, *x1 = y0 + edges, *y1 = x1 + edges;
            double away = length((*x0 + *x1) / 2 - x, (*y0 + *y1) / 2 - y);
            if (away < range_max + length(*x1 - *x0, *y1 - *y0) / 2)
                a.array[NEAREST][i] = least(a.array[NEAREST][i], in_cone(&e, k, x, y, a.array[TURNS][i],
                    a.array[TURNS][cones + i], a.number[SLOPE], a.number[STRETCH]));
        }
    }
    release(&a);
    Py_RETURN_NONE;
}
