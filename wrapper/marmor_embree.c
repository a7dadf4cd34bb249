/* Embree 3 and 4 behind marmor_embree.h. All that differs between versions is in this file. */
#include "marmor_embree.h"

#if MARMOR_EMBREE_MAJOR == 4
#include <embree4/rtcore.h>
#elif MARMOR_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#else
#error "the build script sets MARMOR_EMBREE_MAJOR to 3 or 4"
#endif

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if RTC_VERSION_MAJOR != MARMOR_EMBREE_MAJOR
#error "embree3/ or embree4/ holds headers of another version"
#endif

/* The Rust side asserts the same sizes. */
_Static_assert(sizeof(MarmorRay) == 32, "MarmorRay is eight floats");
_Static_assert(sizeof(MarmorHit) == 20, "MarmorHit is three floats and two numbers");
_Static_assert(sizeof(unsigned) == 4 && sizeof(float) == 4, "indices and coordinates are 32 bits");
_Static_assert(sizeof(struct RTCRayHit) == sizeof(struct RTCRay) + sizeof(struct RTCHit), "a ray, then a hit");

struct MarmorScene {
    RTCDevice device;
    RTCScene scene;
    bool packets; /* whether this library traces them, and as single rays */
    float scale;  /* Embree's coordinates over the caller's; a power of two */
    _Atomic long long bytes;
    atomic_flag has_error; /* Embree reports from its own threads too */
    char error[512];       /* text of the first device error since the last `status`, empty if none */
};

/* Embree writes a whole RTCRayHit of its own header, whose size grew between versions; the guard lies behind it. */
#define GUARD 0xA5
typedef struct {
    struct RTCRayHit rayhit;
    unsigned char guard[64];
} GuardedRayHit;

static const char *code_name(enum RTCError code) {
    switch (code) {
    case RTC_ERROR_NONE: return "no error";
    case RTC_ERROR_INVALID_ARGUMENT: return "invalid argument";
    case RTC_ERROR_INVALID_OPERATION: return "invalid operation";
    case RTC_ERROR_OUT_OF_MEMORY: return "out of memory";
    case RTC_ERROR_UNSUPPORTED_CPU: return "unsupported CPU";
    case RTC_ERROR_CANCELLED: return "cancelled";
    default: return "unknown error";
    }
}

static void on_error(void *user, enum RTCError code, const char *text) {
    MarmorScene *scene = user;
    if (!atomic_flag_test_and_set(&scene->has_error)) /* the first error is the cause of those that follow */
        snprintf(scene->error, sizeof scene->error, "%s (%s)", text && *text ? text : "no text", code_name(code));
}

static bool on_memory(void *user, ssize_t bytes, bool post) {
    (void)post;
    atomic_fetch_add(&((MarmorScene *)user)->bytes, (long long)bytes);
    return true;
}

static int fail(char *message, unsigned message_bytes, const char *text) {
    if (message && message_bytes) snprintf(message, message_bytes, "%s", text);
    return MARMOR_FAILED;
}

/* MARMOR_FAILED with Embree's text if a device error came up since the last call. */
static int status(MarmorScene *scene, char *message, unsigned message_bytes) {
    enum RTCError code = rtcGetDeviceError(scene->device);
    if (code == RTC_ERROR_NONE && scene->error[0] == '\0') return MARMOR_OK;
    fail(message, message_bytes, scene->error[0] ? scene->error : code_name(code));
    scene->error[0] = '\0';
    atomic_flag_clear(&scene->has_error);
    return MARMOR_FAILED;
}

/* `t` moved by a few units in the last place; ends of intervals are not negative. */
static float moved(float t, int units) {
    if (!(t > 0.0f)) return 0.0f; /* -0 is the least of all integers: nothing can be taken off it */
    int bits;
    memcpy(&bits, &t, sizeof bits);
    bits = bits + units > 0 ? bits + units : 0;
    memcpy(&t, &bits, sizeof bits);
    return t;
}

/* Embree's interval is closed above and its test of it comes before a division by an approximate reciprocal. Ends moved
 * inwards by more than that division can lose make it the open one for both kinds of query, in the same way. */
#define LAST_PLACES 4

/* Embree's kernels hold thresholds of their own (weights become zero where areas are below 1e-18), so what they find
 * depends on the unit. They get the scene with its largest coordinate near 2^16 and directions with their largest component
 * near 1. All factors are powers of two, which lose nothing: hits are as exact as the kernels, at any scale. */
#define LARGEST_EXPONENT 16

/* The power of two that brings `largest` to between 2^(to - 1) and 2^to, or as near as a float can. */
static float power_to(float largest, int to) {
    int e = 0;
    frexpf(largest, &e);
    e = to - e;
    return ldexpf(1.0f, e < -126 ? -126 : e > 126 ? 126 : e);
}

static float direction_scale(const MarmorRay *ray) {
    float x = fabsf(ray->direction[0]), y = fabsf(ray->direction[1]), z = fabsf(ray->direction[2]);
    float largest = x > y ? x : y;
    largest = z > largest ? z : largest;
    int bits; /* the exponent of a normal number, without the call of frexpf for every ray */
    memcpy(&bits, &largest, sizeof bits);
    int e = (bits >> 23) - 127;
    if (e < -126 || e > 126) return power_to(largest, 1);
    bits = (127 - e) << 23;
    float scale;
    memcpy(&scale, &bits, sizeof scale);
    return scale;
}

/* Returns what distances of this ray must be multiplied with to become the caller's. */
static float set_ray(struct RTCRay *to, const MarmorRay *ray, float scale) {
    float direction = direction_scale(ray);
    double t_scale = (double)scale / direction; /* may be beyond a float; the products below need not be */
    to->org_x = ray->origin[0] * scale;
    to->org_y = ray->origin[1] * scale;
    to->org_z = ray->origin[2] * scale;
    float t_min = (float)(ray->t_min * t_scale), t_max = (float)(ray->t_max * t_scale);
    to->tnear = t_min > 0.0f ? moved(t_min, LAST_PLACES) : 0.0f;
    to->dir_x = ray->direction[0] * direction;
    to->dir_y = ray->direction[1] * direction;
    to->dir_z = ray->direction[2] * direction;
    to->time = 0.0f;
    to->tfar = isinf(t_max) ? t_max : moved(t_max, -LAST_PLACES);
    to->mask = 0xffffffffu;
    to->id = 0;
    to->flags = 0;
    return (float)(1.0 / t_scale);
}

static void intersect(RTCScene scene, struct RTCRayHit *rayhit) {
    rayhit->hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rayhit->hit.primID = RTC_INVALID_GEOMETRY_ID;
#if MARMOR_EMBREE_MAJOR == 4
    rtcIntersect1(scene, rayhit, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, rayhit);
#endif
}

int marmor_scene_closest(const MarmorScene *scene, const MarmorRay *ray, MarmorHit *hit) {
    struct RTCRayHit rayhit;
    float per_t = set_ray(&rayhit.ray, ray, scene->scale);
    if (!(rayhit.ray.tnear < rayhit.ray.tfar)) return MARMOR_MISS;
    intersect(scene->scene, &rayhit);
    if (rayhit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return MARMOR_MISS;
    hit->t = rayhit.ray.tfar * per_t;
    hit->u = rayhit.hit.u;
    hit->v = rayhit.hit.v;
    hit->mesh = rayhit.hit.geomID;
    hit->triangle = rayhit.hit.primID;
    return MARMOR_HIT;
}

int marmor_scene_occluded(const MarmorScene *scene, const MarmorRay *ray) {
    struct RTCRay query;
    set_ray(&query, ray, scene->scale);
    if (!(query.tnear < query.tfar)) return MARMOR_MISS;
#if MARMOR_EMBREE_MAJOR == 4
    rtcOccluded1(scene->scene, &query, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene->scene, &context, &query);
#endif
    return query.tfar == -INFINITY ? MARMOR_HIT : MARMOR_MISS; /* how Embree reports occlusion */
}

/* Rays that are handed over together: packets are in both versions, while Embree 4 has dropped streams. */
#define PACKET 16

/* `count` rays, at most PACKET, in the layout of packets; lanes left over and empty intervals are not valid. */
static void set_packet(struct RTCRay16 *to, int *valid, float *per_t, const MarmorRay *rays, unsigned count, float scale) {
    for (unsigned i = 0; i < PACKET; i++) {
        struct RTCRay ray;
        per_t[i] = set_ray(&ray, &rays[i < count ? i : 0], scale);
        valid[i] = i < count && ray.tnear < ray.tfar ? -1 : 0;
        to->org_x[i] = ray.org_x;
        to->org_y[i] = ray.org_y;
        to->org_z[i] = ray.org_z;
        to->tnear[i] = ray.tnear;
        to->dir_x[i] = ray.dir_x;
        to->dir_y[i] = ray.dir_y;
        to->dir_z[i] = ray.dir_z;
        to->time[i] = 0.0f;
        to->tfar[i] = ray.tfar;
        to->mask[i] = 0xffffffffu;
        to->id[i] = 0;
        to->flags[i] = 0;
    }
}

static void intersect_packet(RTCScene scene, const int *valid, struct RTCRayHit16 *packet) {
    for (unsigned i = 0; i < PACKET; i++) {
        packet->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        packet->hit.primID[i] = RTC_INVALID_GEOMETRY_ID;
    }
#if MARMOR_EMBREE_MAJOR == 4
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    rtcIntersect16(valid, scene, packet, &arguments);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene, &context, packet);
#endif
}

static void occluded_packet(RTCScene scene, const int *valid, struct RTCRay16 *packet) {
#if MARMOR_EMBREE_MAJOR == 4
    rtcOccluded16(valid, scene, packet, NULL);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded16(valid, scene, &context, packet);
#endif
}

/* Whether the first `count` rays start at one point: camera rays do. */
static bool from_one_point(const MarmorRay *rays, unsigned count) {
    for (unsigned i = 1; i < count; i++)
        if (memcmp(rays[i].origin, rays[0].origin, sizeof rays[0].origin) != 0) return false;
    return true;
}

void marmor_scene_closest_batch(const MarmorScene *scene, const MarmorRay *rays, unsigned count, MarmorHit *hits,
                                unsigned char *found) {
    for (unsigned first = 0; first < count; first += PACKET) {
        unsigned n = count - first < PACKET ? count - first : PACKET;
        if (!scene->packets || !from_one_point(rays + first, n)) {
            /* Rays that have nothing in common are no faster together. */
            for (unsigned i = first; i < first + n; i++)
                found[i] = (unsigned char)marmor_scene_closest(scene, rays + i, hits + i);
            continue;
        }
        struct RTCRayHit16 packet;
        _Alignas(64) int valid[PACKET];
        float per_t[PACKET];
        set_packet(&packet.ray, valid, per_t, rays + first, n, scene->scale);
        intersect_packet(scene->scene, valid, &packet);
        for (unsigned i = 0; i < n; i++) {
            MarmorHit *hit = hits + first + i;
            found[first + i] = packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID ? MARMOR_HIT : MARMOR_MISS;
            hit->t = packet.ray.tfar[i] * per_t[i];
            hit->u = packet.hit.u[i];
            hit->v = packet.hit.v[i];
            hit->mesh = packet.hit.geomID[i];
            hit->triangle = packet.hit.primID[i];
        }
    }
}

void marmor_scene_occluded_batch(const MarmorScene *scene, const MarmorRay *rays, unsigned count, unsigned char *found) {
    for (unsigned first = 0; first < count; first += PACKET) {
        unsigned n = count - first < PACKET ? count - first : PACKET;
        if (!scene->packets) {
            for (unsigned i = first; i < first + n; i++)
                found[i] = (unsigned char)marmor_scene_occluded(scene, rays + i);
            continue;
        }
        struct RTCRay16 packet;
        _Alignas(64) int valid[PACKET];
        float per_t[PACKET];
        set_packet(&packet, valid, per_t, rays + first, n, scene->scale);
        occluded_packet(scene->scene, valid, &packet);
        for (unsigned i = 0; i < n; i++)
            found[first + i] = valid[i] && packet.tfar[i] == -INFINITY ? MARMOR_HIT : MARMOR_MISS;
    }
}

static RTCScene new_scene(RTCDevice device) {
    RTCScene scene = rtcNewScene(device);
    if (scene) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    return scene;
}

static void add_triangles(RTCDevice device, RTCScene scene, float scale, unsigned mesh, const float *positions,
                          unsigned vertices, const unsigned *triangles, unsigned triangle_count) {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!geometry) return; /* the device holds the error */
    /* Embree reads 16 bytes at each vertex: a fourth float keeps the last read inside the buffer. */
    float *to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 4 * sizeof(float),
                                        vertices);
    unsigned *indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                3 * sizeof(unsigned), triangle_count);
    if (to && indices) {
        for (size_t i = 0; i < vertices; i++) {
            for (size_t k = 0; k < 3; k++) to[4 * i + k] = positions[3 * i + k] * scale;
            to[4 * i + 3] = 0.0f;
        }
        memcpy(indices, triangles, (size_t)triangle_count * 3 * sizeof(unsigned));
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, mesh);
    }
    rtcReleaseGeometry(geometry);
}

static bool near(float a, float b) { return fabsf(a - b) <= 1e-5f; } /* the values checked are of order 1 */

/* Whether packets of two known rays find and miss what they must; `wrong` is set if they write where they must not. A
 * library may be built without packets, and then reports an error. */
static bool known_packets(RTCDevice device, RTCScene scene, const MarmorRay *hit_and_miss, const char **wrong) {
    struct {
        struct RTCRayHit16 rayhit;
        unsigned char guard[64];
    } q;
    _Alignas(64) int valid[PACKET];
    float per_t[PACKET];
    memset(&q, GUARD, sizeof q);
    set_packet(&q.rayhit.ray, valid, per_t, hit_and_miss, 2, 1.0f);
    intersect_packet(scene, valid, &q.rayhit);
    for (size_t i = 0; i < sizeof q.guard; i++)
        if (q.guard[i] != GUARD) *wrong = "the library writes beyond the header's RTCRayHit16";
    bool right = q.rayhit.hit.geomID[0] == 5 && q.rayhit.hit.primID[0] == 0 && near(q.rayhit.ray.tfar[0] * per_t[0], 2.0f) &&
                 near(q.rayhit.hit.u[0], 0.25f) && near(q.rayhit.hit.v[0], 0.25f) &&
                 q.rayhit.hit.geomID[1] == RTC_INVALID_GEOMETRY_ID;
    set_packet(&q.rayhit.ray, valid, per_t, hit_and_miss, 2, 1.0f);
    occluded_packet(scene, valid, &q.rayhit.ray);
    right = right && q.rayhit.ray.tfar[0] == -INFINITY && q.rayhit.ray.tfar[1] != -INFINITY;
    return rtcGetDeviceError(device) == RTC_ERROR_NONE && right;
}

/* The triangle (1,0,3) (3,0,3) (1,4,3) as geometry 5 and the ray from (1.5,1,-1) along (0,0,2) meet at t = 2 with
 * u = v = 1/4 and the normal (0,0,8) or its opposite, whose direction Embree has changed; the ray from (3,3,-1) passes by.
 * Returns what was wrong or NULL, and whether packets work. */
static const char *known_rays(RTCDevice device, bool *packets) {
    static const float positions[9] = {1, 0, 3, 3, 0, 3, 1, 4, 3};
    static const unsigned triangle[3] = {0, 1, 2};
    const char *wrong = NULL;
    RTCScene rtc_scene = new_scene(device);
    if (!rtc_scene) return "no scene can be made";
    add_triangles(device, rtc_scene, 1.0f, 5, positions, 3, triangle, 1);
    rtcCommitScene(rtc_scene);

    GuardedRayHit q;
    MarmorRay ray = {{1.5f, 1.0f, -1.0f}, 0.0f, {0.0f, 0.0f, 2.0f}, INFINITY};
    memset(&q, GUARD, sizeof q);
    float per_t = set_ray(&q.rayhit.ray, &ray, 1.0f);
    intersect(rtc_scene, &q.rayhit);
    for (size_t i = 0; i < sizeof q.guard; i++)
        if (q.guard[i] != GUARD) wrong = "the library writes beyond the header's RTCRayHit";
    const struct RTCHit *hit = &q.rayhit.hit;
    if (hit->geomID != 5 || hit->primID != 0)
        wrong = "a ray with a known hit finds another triangle or none";
    else if (!near(q.rayhit.ray.tfar * per_t, 2.0f))
        wrong = "a ray with a known hit has another distance";
    else if (!near(hit->u, 0.25f) || !near(hit->v, 0.25f))
        wrong = "a ray with a known hit has other barycentric coordinates";
    else if (!near(hit->Ng_x, 0.0f) || !near(hit->Ng_y, 0.0f) || !near(fabsf(hit->Ng_z), 8.0f))
        wrong = "a ray with a known hit has another normal";

    MarmorRay beside = {{3.0f, 3.0f, -1.0f}, 0.0f, {0.0f, 0.0f, 2.0f}, INFINITY};
    MarmorScene scene = {.device = device, .scene = rtc_scene, .scale = 1.0f};
    MarmorHit none;
    if (!wrong && marmor_scene_occluded(&scene, &ray) != MARMOR_HIT)
        wrong = "a ray with a known hit is not occluded";
    if (!wrong && (marmor_scene_closest(&scene, &beside, &none) != MARMOR_MISS ||
                   marmor_scene_occluded(&scene, &beside) != MARMOR_MISS))
        wrong = "a ray with a known miss hits";
    MarmorRay both[2] = {ray, beside};
    if (!wrong) *packets = known_packets(device, rtc_scene, both, &wrong);
    rtcReleaseScene(rtc_scene);
    return wrong;
}

int marmor_scene_open(MarmorScene **out, float largest, char *message, unsigned message_bytes) {
    char text[512];
    *out = NULL;
    MarmorScene *scene = calloc(1, sizeof *scene);
    if (!scene) return fail(message, message_bytes, "out of memory");
    atomic_flag_clear(&scene->has_error);
    scene->scale = largest > 0.0f ? power_to(largest, LARGEST_EXPONENT) : 1.0f;
    scene->device = rtcNewDevice(NULL);
    if (!scene->device) {
        snprintf(text, sizeof text, "no device: %s", code_name(rtcGetDeviceError(NULL)));
        marmor_scene_close(scene);
        return fail(message, message_bytes, text);
    }
    unsigned version = marmor_scene_version(scene);
    if (version / 100 != RTC_VERSION / 100) { /* patches keep the ABI, minor versions need not */
        snprintf(text, sizeof text, "the library is %u.%u.%u but the build used the headers of " RTC_VERSION_STRING
                 "; rebuild with headers and library of one version", version / 10000, version / 100 % 100, version % 100);
        marmor_scene_close(scene);
        return fail(message, message_bytes, text);
    }
    rtcSetDeviceErrorFunction(scene->device, on_error, scene);
    const char *wrong = known_rays(scene->device, &scene->packets);
    if (!wrong && !scene->packets) { /* the library has none: no reason to stop */
        scene->error[0] = '\0';
        atomic_flag_clear(&scene->has_error);
    }
    if (wrong || status(scene, text, sizeof text) != MARMOR_OK) {
        char both[1024];
        snprintf(both, sizeof both, "self-check of Embree %u.%u.%u failed: %s", version / 10000, version / 100 % 100,
                 version % 100, wrong ? wrong : text);
        marmor_scene_close(scene);
        return fail(message, message_bytes, both);
    }
    rtcSetDeviceMemoryMonitorFunction(scene->device, on_memory, scene);
    scene->scene = new_scene(scene->device);
    if (status(scene, message, message_bytes) != MARMOR_OK) {
        marmor_scene_close(scene);
        return MARMOR_FAILED;
    }
    *out = scene;
    return MARMOR_OK;
}

int marmor_scene_add(MarmorScene *scene, unsigned mesh, const float *positions, unsigned vertices,
                     const unsigned *triangles, unsigned triangle_count, char *message, unsigned message_bytes) {
    if (triangle_count == 0) return MARMOR_OK;
    add_triangles(scene->device, scene->scene, scene->scale, mesh, positions, vertices, triangles, triangle_count);
    return status(scene, message, message_bytes);
}

int marmor_scene_commit(MarmorScene *scene, char *message, unsigned message_bytes) {
    rtcCommitScene(scene->scene);
    return status(scene, message, message_bytes);
}

unsigned long long marmor_scene_bytes(const MarmorScene *scene) {
    long long bytes = atomic_load(&scene->bytes);
    return bytes > 0 ? (unsigned long long)bytes : 0;
}

unsigned marmor_scene_version(const MarmorScene *scene) {
    return (unsigned)rtcGetDeviceProperty(scene->device, RTC_DEVICE_PROPERTY_VERSION);
}

void marmor_scene_close(MarmorScene *scene) {
    if (!scene) return;
    if (scene->scene) rtcReleaseScene(scene->scene);
    if (scene->device) rtcReleaseDevice(scene->device);
    free(scene);
}
