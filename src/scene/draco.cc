#include "scene/draco.h"

#include <cstdio>
#include <cstring>
#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#include <exception>
#include <memory>

struct draco_geometry {
    std::unique_ptr<draco::Mesh> mesh;
};

/* Draco bitstream 2.2: "DRACO", version, encoder type, method, flags; then the metadata; then, for
 * edgebreaker, a traversal type; then the counts. */
static bool read_claims(draco::DecoderBuffer *buffer, uint32_t counts[2], bool *edgebreaker)
{
    uint8_t head[9], traversal;
    uint16_t flags;
    if (!buffer->Decode(head, sizeof head) || std::memcmp(head, "DRACO", 5) ||
        !buffer->Decode(&flags, sizeof flags))
        return false;
    const uint16_t version = static_cast<uint16_t>(head[5] << 8 | head[6]);
    buffer->set_bitstream_version(version);
    *edgebreaker = head[8] == 1;
    if (version < 0x0202)
        return true;
    draco::GeometryMetadata metadata;
    if (flags & 0x8000 && !draco::MetadataDecoder().DecodeGeometryMetadata(buffer, &metadata))
        return false;
    if (*edgebreaker && !buffer->Decode(&traversal, sizeof traversal))
        return false;
    return draco::DecodeVarint(&counts[0], buffer) && draco::DecodeVarint(&counts[1], buffer);
}

bool draco_claims(const void *data, size_t size, uint64_t *triangles, uint64_t *points)
{
    try {
        draco::DecoderBuffer buffer;
        uint32_t counts[2] = {0, 0};
        bool edgebreaker = false;
        buffer.Init(static_cast<const char *>(data), size);
        const bool good = read_claims(&buffer, counts, &edgebreaker);
        *triangles = counts[edgebreaker ? 1 : 0];
        *points = counts[edgebreaker ? 0 : 1];
        return good;
    } catch (...) {
        return false;
    }
}

struct draco_geometry *draco_decode(const void *data, size_t size, char *message,
                                    size_t message_size)
{
    try {
        draco::DecoderBuffer buffer;
        buffer.Init(static_cast<const char *>(data), size);
        draco::Decoder decoder;
        auto result = decoder.DecodeMeshFromBuffer(&buffer);
        if (!result.ok()) {
            std::snprintf(message, message_size, "%s", result.status().error_msg());
            return nullptr;
        }
        std::unique_ptr<draco::Mesh> mesh = std::move(result).value();
        for (draco::FaceIndex f(0); f < mesh->num_faces(); ++f)
            for (int c = 0; c < 3; c++)
                if (mesh->face(f)[c].value() >= mesh->num_points()) {
                    std::snprintf(message, message_size, "a face names a point that is not there");
                    return nullptr;
                }
        return new draco_geometry{std::move(mesh)};
    } catch (const std::exception &problem) {
        std::snprintf(message, message_size, "%s", problem.what());
    } catch (...) {
        std::snprintf(message, message_size, "unknown problem");
    }
    return nullptr;
}

void draco_free(struct draco_geometry *geometry)
{
    delete geometry;
}

size_t draco_points(const struct draco_geometry *geometry)
{
    return geometry->mesh->num_points();
}

size_t draco_triangles(const struct draco_geometry *geometry)
{
    return geometry->mesh->num_faces();
}

void draco_indices(const struct draco_geometry *geometry, uint32_t *out)
{
    const draco::Mesh &mesh = *geometry->mesh;
    for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
        for (int c = 0; c < 3; c++)
            *out++ = mesh.face(f)[c].value();
}

template <typename T> static float load(const uint8_t *bytes)
{
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<float>(value);
}

typedef float load_fn(const uint8_t *bytes);

static load_fn *loader_of(draco::DataType type)
{
    switch (type) {
    case draco::DT_INT8:
        return load<int8_t>;
    case draco::DT_UINT8:
        return load<uint8_t>;
    case draco::DT_INT16:
        return load<int16_t>;
    case draco::DT_UINT16:
        return load<uint16_t>;
    case draco::DT_INT32:
        return load<int32_t>;
    case draco::DT_UINT32:
        return load<uint32_t>;
    case draco::DT_FLOAT32:
        return load<float>;
    case draco::DT_FLOAT64:
        return load<double>;
    default:
        return nullptr;
    }
}

bool draco_floats(const struct draco_geometry *geometry, uint32_t unique_id, int components,
                  float *out, bool *integers)
{
    const draco::PointAttribute *attribute = geometry->mesh->GetAttributeByUniqueId(unique_id);
    load_fn *loader = attribute ? loader_of(attribute->data_type()) : nullptr;
    if (!loader || !attribute->buffer())
        return false;
    *integers = draco::IsDataTypeIntegral(attribute->data_type());
    const size_t step = static_cast<size_t>(draco::DataTypeLength(attribute->data_type()));
    const int present = attribute->num_components();
    const size_t points = draco_points(geometry), need = step * static_cast<size_t>(present);
    const int64_t stride = attribute->byte_stride(), start = attribute->byte_offset();
    for (size_t p = 0; p < points; p++) {
        const draco::PointIndex point(static_cast<uint32_t>(p));
        if (!attribute->is_mapping_identity() && p >= attribute->indices_map_size())
            return false;
        const int64_t offset = start + stride * attribute->mapped_index(point).value();
        if (offset < 0 || static_cast<size_t>(offset) + need > attribute->buffer()->data_size())
            return false;
        const uint8_t *bytes = attribute->buffer()->data() + offset;
        for (int c = 0; c < components; c++)
            *out++ = c < present ? loader(bytes + static_cast<size_t>(c) * step) : 0.0f;
    }
    return true;
}
