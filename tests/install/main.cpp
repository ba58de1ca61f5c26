#include <castor/castor.h>

#include <iostream>

int main() try {
    castor::Scene scene;
    scene.ambient_light = {30, 30, 30};
    scene.materials = {
        {.ambient = {1, 1, 1}, .diffuse = {0.9f, 0.5f, 0.2f}, .specular = {0.6f, 0.6f, 0.6f}, .phong_exponent = 60},
        {.kind = castor::MaterialKind::mirror,
         .ambient = {1, 1, 1},
         .diffuse = {0.4f, 0.5f, 0.7f},
         .mirror = {0.4f, 0.4f, 0.4f}}};
    scene.spheres = {{.center = {0, 1, 0}, .radius = 1, .material = 0}};
    scene.planes = {{.point = {0, 0, 0}, .normal = {0, 1, 0}, .material = 1}};
    scene.lights = {{.point = {.position = {4, 6, 4}, .intensity = {9000, 9000, 9000}}}};
    castor::add_default_view(scene);  // a camera that sees the sphere

    castor::Renderer renderer(scene, castor::select_devices());
    const castor::Film film = renderer.render(scene.cameras[0], {.samples_per_pixel = 4});
    castor::write_image("sphere.png", film);
    std::cout << "sphere.png: " << renderer.statistics().rays << " rays\n";
} catch (const castor::Error& error) {
    std::cerr << error.what() << '\n';
    return 1;
}
