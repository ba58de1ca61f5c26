// The columns of a scene, written once and read by both compilers. All else follows from this list: the members of
// SceneArrays and Chunk, the sections of a saved scene, the fingerprint, the buffers on a device, and the parameters of
// the kernels that read them. To add a column: add its row here, then the code that fills it and the code that uses it.
#ifndef CASTOR_SHARED_SCENE_COLUMNS_H
#define CASTOR_SHARED_SCENE_COLUMNS_H

// A row: column(name, element on the host, element on the device, one per, place, made, trace, surface)
//
//   element   The device may read an element as several: three floats for a glm::vec3.
//   one per   What the column has one element of. Columns with the same word have the same number of elements.
//   place     cut: chunks have parts of it. chunk: every chunk has a small one of its own; planes are in the first
//             chunk alone. scene: the first chunk has it, and on a device all chunks use the same buffer.
//   made      flat: by `flatten`, so a member of SceneArrays and part of the fingerprint, in this order.
//             tree: when trees are built and chunks are cut, so a member of Chunk.
//   trace     Whether trace kernels read it.
//   surface   Whether find_surface reads it.
//
// A saved scene has the columns that are cut first, then the others, both in this order: changing the order, a name or
// an element on the host changes the file format.
// clang-format off
#define CASTOR_SCENE_COLUMNS(column)                                                                                   \
  column(vertex_position,       glm::vec3,                  float,              vertex,         cut,   flat, yes, yes) \
  column(triangle_vertices,     glm::uvec3,                 uint,               triangle,       cut,   flat, yes, yes) \
  column(vertex_normal,         glm::vec3,                  float,              normal,         cut,   flat, no,  yes) \
  column(vertex_uv,             glm::vec2,                  float,              uv,             cut,   flat, no,  no)  \
  column(vertex_attributes,     shared::VertexAttributes,   VertexAttributes,   attributes,     cut,   flat, no,  no)  \
  column(mesh_ranges,           shared::MeshRange,          MeshRange,          mesh,           chunk, flat, yes, yes) \
  column(sphere_center_radius,  glm::vec4,                  float4,             sphere,         cut,   flat, yes, yes) \
  column(sphere_material,       std::uint32_t,              uint,               sphere,         cut,   flat, no,  yes) \
  column(plane_point,           glm::vec4,                  float4,             plane,          chunk, flat, yes, no)  \
  column(plane_normal,          glm::vec4,                  float4,             plane,          chunk, flat, yes, yes) \
  column(plane_material,        std::uint32_t,              uint,               plane,          chunk, flat, no,  yes) \
  column(geometries,            shared::Geometry,           Geometry,           geometry,       chunk, flat, yes, yes) \
  column(instances,             shared::Instance,           Instance,           instance,       scene, flat, yes, yes) \
  column(materials,             shared::Material,           Material,           material,       scene, flat, no,  no)  \
  column(principled_materials,  shared::PrincipledMaterial, PrincipledMaterial, principled,     scene, flat, no,  no)  \
  column(lights,                shared::Light,              Light,              light,          scene, flat, no,  no)  \
  column(textures,              shared::Texture,            Texture,            texture,        scene, flat, no,  no)  \
  column(texture_uses,          std::uint32_t,              uint,               texture_use,    scene, flat, no,  no)  \
  column(texture_images,        shared::TextureImage,       TextureImage,       texture_image,  scene, flat, no,  no)  \
  column(texels,                std::uint32_t,              uint,               texel,          scene, flat, no,  no)  \
  column(emitters,              shared::Emitter,            Emitter,            emitter,        scene, flat, no,  no)  \
  column(environment_parts,     std::uint32_t,              uint,               light_part,     scene, flat, no,  no)  \
  column(light_nodes,           shared::LightNode,          LightNode,          light_node,     scene, flat, no,  no)  \
  column(primitive_numbers,     std::uint32_t,              uint,               primitive,      cut,   tree, yes, yes) \
  column(compressed_nodes,      shared::CompressedNode,     CompressedNode,     compact_node,   cut,   tree, yes, no)  \
  column(compressed_primitives, std::uint32_t,              uint,               leaf_primitive, cut,   tree, yes, no)  \
  column(compressed_roots,      std::uint32_t,              uint,               compact_tree,   chunk, tree, yes, no)  \
  column(wide_nodes,            shared::WideNode,           WideNode,           wide_node,      cut,   tree, yes, no)  \
  column(triangle_blocks,       shared::TriangleBlock,      TriangleBlock,      triangle_block, cut,   tree, yes, no)  \
  column(sphere_blocks,         shared::SphereBlock,        SphereBlock,        sphere_block,   cut,   tree, yes, no)  \
  column(wide_roots,            std::uint32_t,              uint,               wide_tree,      chunk, tree, yes, no)  \
  column(instance_nodes,        shared::InstanceNode,       InstanceNode,       instance_node,  chunk, tree, yes, no)  \
  column(wide_instance_nodes,   shared::WideNode,           WideNode,           wide_instances, chunk, tree, yes, no)
// clang-format on

#endif
