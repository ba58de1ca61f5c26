#include <castor/castor_c.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void check(castor_status status) {
    if (status == CASTOR_STATUS_DONE) return;
    fprintf(stderr, "%s: %s\n", castor_status_string(status), castor_last_error_message());
    exit(1);
}

int main(void) {
    const float vertices[] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 4};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    const castor_mesh mesh = {
        .size = sizeof mesh, .vertices = vertices, .vertex_count = 4, .triangles = triangles, .triangle_count = 4};
    castor_scene* scene = NULL;
    check(castor_scene_create(&scene));
    check(castor_scene_add_mesh(scene, &mesh, NULL));
    check(castor_scene_add_default_view(scene));  // a camera, lights and a material

    castor_tracer* tracer = NULL;
    castor_ray rays[4];
    castor_hit hits[4];
    check(castor_tracer_create(scene, NULL, NULL, &tracer));
    for (int i = 0; i < 4; ++i) {
        const castor_ray ray = {.origin = {1 + (float)i, 0.5f, 10}, .direction = {0, 0, -1}, .t_max = INFINITY};
        rays[i] = ray;
    }
    check(castor_tracer_closest_hit(tracer, rays, 4, hits, NULL));
    for (int i = 0; i < 4; ++i) printf("ray %d: distance %g\n", i, hits[i].t);  // 7.5, 8.5, 9.5, inf

    castor_renderer* renderer = NULL;
    castor_film* film = NULL;
    castor_camera camera = {.size = sizeof camera};
    const castor_render_options options = {.size = sizeof options, .samples_per_pixel = 4};
    check(castor_scene_get_camera(scene, 0, &camera));
    check(castor_camera_resize(&camera, 320, 240));
    check(castor_renderer_create(scene, NULL, NULL, &renderer));
    check(castor_renderer_render(renderer, &camera, &options, &film));
    check(castor_film_write_image(film, "tetrahedron.png", NULL));
    puts("tetrahedron.png is written");

    castor_film_release(film);
    castor_renderer_release(renderer);
    castor_tracer_release(tracer);
    castor_scene_release(scene);
    return 0;
}
