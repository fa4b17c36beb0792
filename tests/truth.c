/* Truths are found by content: what instances are counts, what they are called does not. */
#include "frame_scenes.h"
#include "scene_files.h"

#include <cranny/truth.h>

static struct cranny_error why;
static char *folder;

/* Whether the folder had the truth already; it has afterwards. */
static bool kept(const struct stage *stage, const struct cranny_frame *frame)
{
    struct cranny_raytrace_params params = cranny_raytrace_params_default();
    struct cranny_truth truth;
    params.rays = 4;
    params.error_target = 0;
    CHECK_OK(cranny_truth_get(stage->scene, frame, &params, folder, &truth, &why), why);
    const bool answer = truth.kept;
    cranny_truth_free(&truth);
    return answer;
}

/* The frame stays as it was: only the instances' roles differ. */
static void test_roles(void)
{
    struct stage stage = room();
    const struct cranny_frame_params params = frame_size(16, 8);
    struct cranny_frame *frame = draw(&stage, &params);
    CHECK(!kept(&stage, frame));
    CHECK(kept(&stage, frame));
    for (int role = CRANNY_ROLE_TREE; role < CRANNY_ROLE_COUNT; role++) {
        const struct cranny_role_rule rule = {"*", (enum cranny_role)role};
        CHECK_OK(cranny_scene_assign_roles(stage.scene, &rule, 1, NULL, &why), why);
        CHECK(!kept(&stage, frame));
        CHECK(kept(&stage, frame));
    }
    const struct cranny_role_rule solid = {"*", CRANNY_ROLE_SOLID};
    CHECK_OK(cranny_scene_assign_roles(stage.scene, &solid, 1, NULL, &why), why);
    CHECK(kept(&stage, frame));
    const struct cranny_instance coarser = {
        .world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, .lod = 1, .lod_group = 1};
    CHECK_OK(cranny_scene_add_instance(stage.scene, &coarser, NULL, &why), why);
    CHECK(!kept(&stage, frame));
    cranny_frame_destroy(&frame);
    leave(&stage);
}

int main(void)
{
    folder = scratch_folder();
    test_roles();
    remove_folder(folder);
    free(folder);
    return check_end("truth");
}
