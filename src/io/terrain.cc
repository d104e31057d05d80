// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "contact_flow/io/contacts.h"
#include "contact_flow/io/map_reader.h"
#include "contact_flow/io/text_file.h"

namespace contact_flow {
namespace {

constexpr std::size_t kMaxTerrainBytes = 1u << 20;

/// Throws for a surface that contacts cannot be made with.
void CheckSurface(const std::string& name, const YAML::Node& surface) {
  MapReader reader(surface, "terrain/" + name);
  std::string kind;
  reader.Require("kind");
  reader.Read("kind", &kind);
  for (const char* edged : {"box", "boxes", "stairs", "step", "mesh", "grid"}) {
    if (kind != edged) continue;
    throw std::invalid_argument("terrain/" + name + "/kind '" + kind +
                                "' has edges, where the distance has no derivative: only planes "
                                "and height fields are taken" +
                                reader.Line("kind"));
  }
  int index = 0;
  reader.Read("kind", {"plane", "height_field"}, &index);
  for (const char* key : {"link", "point", "radius"}) {
    if (!reader.Has(key)) continue;
    throw std::invalid_argument("terrain/" + name + "/" + key +
                                " is of a contact, not of the terrain: take it out" +
                                reader.Line(key));
  }
}

}  // namespace

YAML::Node ReadTerrain(const YAML::Node& value, const std::string& folder) {
  if (!value.IsDefined() || value.IsNull()) return YAML::Node();
  if (value.IsScalar()) {
    const std::string file = value.Scalar();
    const std::string path = file.substr(0, 1) == "/" ? file : folder + file;
    try {
      const YAML::Node read = ParseYamlDocument(ReadTextFile(path, kMaxTerrainBytes));
      if (!read.IsMap()) throw std::invalid_argument("it is not a map of names to surfaces");
      return ReadTerrain(read, folder);
    } catch (const YAML::Exception& error) {
      throw std::invalid_argument("terrain: " + path + ": " + error.what());
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("terrain: " + path + ": " + error.what());
    }
  }
  MapReader reader(value, "terrain");
  for (const std::string& name : reader.Keys()) CheckSurface(name, reader.Child(name));
  return value;
}

}  // namespace contact_flow
