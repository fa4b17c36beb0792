/* Reading other formats through assimp: what the parts of the importer share. */
#ifndef SCENE_IMPORT_H
#define SCENE_IMPORT_H

#include "scene/builder.h"

#include <assimp/cfileio.h>
#include <assimp/scene.h>

struct import {
    const struct aiScene *scene;
    struct document place; /* stands for the input where paths are resolved and memory counted */
    struct builder builder;
    size_t *meshes;      /* per aiMesh: its glTF mesh when a node shows it alone; SIZE_MAX: none */
    json_t **primitives; /* per aiMesh: its primitive, NULL when it is empty; owned */
};

/* import_files.c: assimp's files, kept to the scene's folder and to the memory limit. */
struct import_files {
    struct aiFileIO io;
    const struct document *place;
};
void import_files_begin(struct import_files *files, const struct document *place);

/* import_material.c: all materials, in order. */
enum cranny_status import_materials(struct import *import, struct cranny_error *why);

#endif
