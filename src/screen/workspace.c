#include "screen/prepare.h"

enum cranny_status cranny_workspace_create(struct cranny_workspace **workspace,
                                           struct cranny_error *why)
{
    *workspace = alloc_array(1, sizeof **workspace);
    return *workspace ? CRANNY_OK : fail_memory(why, "workspace");
}

void cranny_workspace_destroy(struct cranny_workspace **workspace)
{
    if (!workspace || !*workspace)
        return;
    workspace_clear(*workspace);
    free(*workspace);
    *workspace = NULL;
}

void workspace_clear(struct cranny_workspace *workspace)
{
    for (int i = 0; i < SLOT_COUNT; i++)
        free(workspace->memory[i]);
    *workspace = (struct cranny_workspace){0};
}

void *workspace_get(struct cranny_workspace *workspace, enum slot slot, size_t count, size_t size)
{
    if (count > SIZE_MAX / size)
        return NULL;
    const size_t need = count * size;
    if (workspace->bytes[slot] >= need)
        return workspace->memory[slot];
    free(workspace->memory[slot]);
    workspace->memory[slot] = alloc_aligned(count, size);
    workspace->bytes[slot] = workspace->memory[slot] ? need : 0;
    return workspace->memory[slot];
}
