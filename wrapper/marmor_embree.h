/* What marmor needs of Embree, free of Embree's types: the same header for Embree 3 and 4.
 *
 * Rust declarations are generated from this file, so it includes nothing and uses only C's basic types.
 * Lengths are in the caller's unit. Functions that can fail return a status and, unless it is MARMOR_OK, write a
 * zero-terminated text of at most `message_bytes` into `message`. No pointer but the scene's outlives a call. */
#ifndef MARMOR_EMBREE_H
#define MARMOR_EMBREE_H

#define MARMOR_OK 0
#define MARMOR_FAILED 1
#define MARMOR_MISS 0
#define MARMOR_HIT 1

/* A device with one scene. Queries may run on many threads at once, after the commit. */
typedef struct MarmorScene MarmorScene;

/* origin + t * direction with t_min < t < t_max; 0 <= t_min. */
typedef struct MarmorRay {
    float origin[3];
    float t_min;
    float direction[3];
    float t_max;
} MarmorRay;

/* The nearest triangle along a ray; u and v weigh its second and third corner. */
typedef struct MarmorHit {
    float t;
    float u;
    float v;
    unsigned mesh;
    unsigned triangle;
} MarmorHit;

/* Opens a device and an empty scene, after checks that the library is the one the header belongs to: its version, and
 * rays with known answers. Writes the scene to `scene`. `largest` is the largest size of a coordinate that will be added. */
int marmor_scene_open(MarmorScene **scene, float largest, char *message, unsigned message_bytes);

/* Copies a mesh: three floats a vertex, three indices a triangle. `mesh` is the number that hits will carry; each number
 * may be used once. A mesh without triangles is none. */
int marmor_scene_add(MarmorScene *scene, unsigned mesh, const float *positions, unsigned vertices,
                     const unsigned *triangles, unsigned triangle_count, char *message, unsigned message_bytes);

/* Builds the tree. Nothing may be added afterwards, and nothing asked before. */
int marmor_scene_commit(MarmorScene *scene, char *message, unsigned message_bytes);

/* MARMOR_HIT with `hit` written, or MARMOR_MISS. */
int marmor_scene_closest(const MarmorScene *scene, const MarmorRay *ray, MarmorHit *hit);

/* MARMOR_HIT if anything is hit. */
int marmor_scene_occluded(const MarmorScene *scene, const MarmorRay *ray);

/* marmor_scene_closest for each of `count` rays: MARMOR_HIT or MARMOR_MISS goes to `found`, hits to `hits`. Rays from one
 * point into nearly one direction are traced together. */
void marmor_scene_closest_batch(const MarmorScene *scene, const MarmorRay *rays, unsigned count, MarmorHit *hits,
                                unsigned char *found);

/* marmor_scene_occluded for each of `count` rays. */
void marmor_scene_occluded_batch(const MarmorScene *scene, const MarmorRay *rays, unsigned count, unsigned char *found);

/* Bytes that Embree holds for this scene: vertices, indices, tree. */
unsigned long long marmor_scene_bytes(const MarmorScene *scene);

/* Version of the library: major * 10000 + minor * 100 + patch. */
unsigned marmor_scene_version(const MarmorScene *scene);

/* Frees the scene; NULL is allowed. */
void marmor_scene_close(MarmorScene *scene);

#endif
