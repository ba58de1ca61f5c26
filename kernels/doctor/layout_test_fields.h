// Every struct that crosses the border between host and device, and every member of it, for layout_test on both sides.
// clang-format off
#define CASTOR_LAYOUT(SIZE, MEMBER)                                                                                   \
    SIZE(Ray) MEMBER(Ray, origin) MEMBER(Ray, t_min) MEMBER(Ray, direction) MEMBER(Ray, t_max)                        \
    SIZE(Hit) MEMBER(Hit, t) MEMBER(Hit, u) MEMBER(Hit, v) MEMBER(Hit, primitive) MEMBER(Hit, instance)               \
    SIZE(MeshRange) MEMBER(MeshRange, first_triangle) MEMBER(MeshRange, first_vertex)                                 \
        MEMBER(MeshRange, first_normal) MEMBER(MeshRange, material) MEMBER(MeshRange, first_uv)                       \
        MEMBER(MeshRange, first_attributes)                                                                           \
    SIZE(VertexAttributes) MEMBER(VertexAttributes, tangent) MEMBER(VertexAttributes, color)                          \
        MEMBER(VertexAttributes, uv_1)                                                                                \
    SIZE(TraceParams) MEMBER(TraceParams, ray_count) MEMBER(TraceParams, first_ray) MEMBER(TraceParams, ray_stride)   \
        MEMBER(TraceParams, direction_offset) MEMBER(TraceParams, triangle_count) MEMBER(TraceParams, sphere_count)   \
        MEMBER(TraceParams, plane_count) MEMBER(TraceParams, mesh_count) MEMBER(TraceParams, node_count)              \
        MEMBER(TraceParams, flags) MEMBER(TraceParams, largest_coordinate) MEMBER(TraceParams, wide_root)             \
        MEMBER(TraceParams, instance_count) MEMBER(TraceParams, instance_node_count)                                  \
        MEMBER(TraceParams, number_count) MEMBER(TraceParams, pass)                                                   \
    SIZE(Geometry) MEMBER(Geometry, first_triangle) MEMBER(Geometry, triangle_count) MEMBER(Geometry, first_sphere)   \
        MEMBER(Geometry, sphere_count) MEMBER(Geometry, largest_coordinate)                                           \
    SIZE(Instance) MEMBER(Instance, to_object) MEMBER(Instance, to_world) MEMBER(Instance, motion) MEMBER(Instance, geometry)                  \
        MEMBER(Instance, material)                                                                                    \
    SIZE(InstanceNode) MEMBER(InstanceNode, lower) MEMBER(InstanceNode, first) MEMBER(InstanceNode, upper)            \
        MEMBER(InstanceNode, is_leaf) MEMBER(InstanceNode, slope)                                                     \
    SIZE(WideNode) MEMBER(WideNode, planes) MEMBER(WideNode, child) MEMBER(WideNode, reserved)                        \
    SIZE(CompressedNode) MEMBER(CompressedNode, origin) MEMBER(CompressedNode, exponent)                              \
        MEMBER(CompressedNode, inner_mask) MEMBER(CompressedNode, first_child)                                        \
        MEMBER(CompressedNode, first_primitive) MEMBER(CompressedNode, meta) MEMBER(CompressedNode, lower)            \
        MEMBER(CompressedNode, upper)                                                                                 \
    SIZE(TriangleBlock) MEMBER(TriangleBlock, vertex) MEMBER(TriangleBlock, primitive)                                \
    SIZE(SphereBlock) MEMBER(SphereBlock, center_radius) MEMBER(SphereBlock, primitive)                               \
    SIZE(Material) MEMBER(Material, ambient) MEMBER(Material, phong_exponent) MEMBER(Material, diffuse)               \
        MEMBER(Material, refraction_index) MEMBER(Material, specular) MEMBER(Material, absorption_index)              \
        MEMBER(Material, mirror) MEMBER(Material, kind) MEMBER(Material, absorption) MEMBER(Material, roughness)      \
        MEMBER(Material, emission) MEMBER(Material, brdf) MEMBER(Material, first_texture)                             \
        MEMBER(Material, texture_count) MEMBER(Material, light) MEMBER(Material, number)                              \
        MEMBER(Material, principled) MEMBER(Material, scattering_albedo)                                              \
    SIZE(PrincipledMaterial) MEMBER(PrincipledMaterial, base_color) MEMBER(PrincipledMaterial, metallic)              \
        MEMBER(PrincipledMaterial, specular_color) MEMBER(PrincipledMaterial, specular)                               \
        MEMBER(PrincipledMaterial, sheen_color) MEMBER(PrincipledMaterial, sheen_roughness)                           \
        MEMBER(PrincipledMaterial, diffuse_transmission_color)                                                        \
        MEMBER(PrincipledMaterial, diffuse_transmission) MEMBER(PrincipledMaterial, roughness)                        \
        MEMBER(PrincipledMaterial, anisotropy) MEMBER(PrincipledMaterial, diffuse_roughness)                          \
        MEMBER(PrincipledMaterial, transmission) MEMBER(PrincipledMaterial, refraction_index)                         \
        MEMBER(PrincipledMaterial, absorption_index) MEMBER(PrincipledMaterial, clearcoat)                            \
        MEMBER(PrincipledMaterial, clearcoat_roughness) MEMBER(PrincipledMaterial, flags)                             \
        MEMBER(PrincipledMaterial, alpha) MEMBER(PrincipledMaterial, alpha_cutoff)                                    \
        MEMBER(PrincipledMaterial, normal_scale) MEMBER(PrincipledMaterial, anisotropy_cosine)                        \
        MEMBER(PrincipledMaterial, anisotropy_sine) MEMBER(PrincipledMaterial, clearcoat_normal_scale)                \
        MEMBER(PrincipledMaterial, dispersion) MEMBER(PrincipledMaterial, iridescence)                                \
        MEMBER(PrincipledMaterial, iridescence_index)                                                                 \
        MEMBER(PrincipledMaterial, iridescence_thickness_minimum)                                                     \
        MEMBER(PrincipledMaterial, iridescence_thickness_maximum) MEMBER(PrincipledMaterial, texture)                 \
        MEMBER(PrincipledMaterial, scattering_anisotropy)                                                             \
    SIZE(Texture) MEMBER(Texture, kind) MEMBER(Texture, target) MEMBER(Texture, image) MEMBER(Texture, filter)        \
        MEMBER(Texture, wrap) MEMBER(Texture, normalizer) MEMBER(Texture, bump_factor) MEMBER(Texture, noise_scale)   \
        MEMBER(Texture, noise_octaves) MEMBER(Texture, noise_conversion) MEMBER(Texture, checker_scale)               \
        MEMBER(Texture, checker_offset) MEMBER(Texture, black) MEMBER(Texture, white)                                 \
        MEMBER(Texture, transform_u) MEMBER(Texture, coordinate_set) MEMBER(Texture, transform_v)                     \
    SIZE(TextureImage) MEMBER(TextureImage, width) MEMBER(TextureImage, height) MEMBER(TextureImage, format)          \
        MEMBER(TextureImage, level_count) MEMBER(TextureImage, first_texel)                                           \
    SIZE(Light) MEMBER(Light, position) MEMBER(Light, kind) MEMBER(Light, intensity) MEMBER(Light, cos_coverage)      \
        MEMBER(Light, direction) MEMBER(Light, cos_falloff) MEMBER(Light, tangent) MEMBER(Light, size)                \
        MEMBER(Light, first) MEMBER(Light, count) MEMBER(Light, mapping) MEMBER(Light, sampling) MEMBER(Light, trail) \
        MEMBER(Light, principled)                                                                                     \
    SIZE(LightNode) MEMBER(LightNode, center) MEMBER(LightNode, radius) MEMBER(LightNode, axis)                       \
        MEMBER(LightNode, cos_normals) MEMBER(LightNode, flux) MEMBER(LightNode, cos_emission)                        \
        MEMBER(LightNode, first) MEMBER(LightNode, flags)                                                             \
    SIZE(PathParams) MEMBER(PathParams, depth) MEMBER(PathParams, node) MEMBER(PathParams, flags)                     \
        MEMBER(PathParams, largest_sample) MEMBER(PathParams, pixel_spread) MEMBER(PathParams, light_node_count)      \
        MEMBER(PathParams, first_far) MEMBER(PathParams, far_end) MEMBER(PathParams, eye_medium)                      \
        MEMBER(PathParams, eye_outer) MEMBER(PathParams, first_unmet) MEMBER(PathParams, unmet_end)                  \
    SIZE(TextureParams) MEMBER(TextureParams, path_count) MEMBER(TextureParams, background)                           \
        MEMBER(TextureParams, pixel_spread)                                                                           \
    SIZE(Emitter) MEMBER(Emitter, corner) MEMBER(Emitter, begin) MEMBER(Emitter, edge_u) MEMBER(Emitter, end)         \
        MEMBER(Emitter, edge_v) MEMBER(Emitter, inverse_double_area) MEMBER(Emitter, uv) MEMBER(Emitter, uv_u)        \
        MEMBER(Emitter, uv_v)                                                                                         \
    SIZE(Camera) MEMBER(Camera, position) MEMBER(Camera, t_min) MEMBER(Camera, corner) MEMBER(Camera, t_max)          \
        MEMBER(Camera, step_x) MEMBER(Camera, width) MEMBER(Camera, step_y) MEMBER(Camera, height)                    \
        MEMBER(Camera, lens_x) MEMBER(Camera, projection) MEMBER(Camera, lens_y) MEMBER(Camera, sharpness)            \
    SIZE(RenderParams) MEMBER(RenderParams, path_count) MEMBER(RenderParams, first_pixel)                             \
        MEMBER(RenderParams, pixel_count) MEMBER(RenderParams, sample_shift) MEMBER(RenderParams, sample)             \
        MEMBER(RenderParams, background) MEMBER(RenderParams, flags) MEMBER(RenderParams, ambient) MEMBER(RenderParams, shadow_epsilon)                \
        MEMBER(RenderParams, light_count) MEMBER(RenderParams, seed) MEMBER(RenderParams, filter)
// clang-format on
