// SPDX-License-Identifier: BSD-3-Clause
#include <sstream>
#include <stdexcept>
#include <vector>

#include "contact_flow/io/map_reader.h"
#include "contact_flow/io/text_file.h"
#include "contacts.h"

namespace contact_flow {
namespace {

constexpr std::size_t kMaxTerrainBytes = 1u << 20, kMaxImageBytes = 1u << 22;
constexpr long kMostPixels = 1 << 17;

/// Heights from an image, a PGM (P2 or P5): black is low, its upper edge has the largest y.
YAML::Node ReadImage(const std::string& path) {
  std::istringstream file(ReadTextFile(path, kMaxImageBytes));
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("image " + path + ": " + why +
                                "; expected a PGM (convert hall.png hall.pgm)");
  };
  std::string magic;
  file >> magic;
  if (magic != "P2" && magic != "P5") refuse("it does not begin with P2 or P5");
  long numbers[3];  // width, height, white
  for (long& number : numbers) {
    while (file >> std::ws && file.peek() == '#') file.ignore(1 << 20, '\n');
    if (!(file >> number)) refuse("its size is missing");
  }
  const auto [width, height, white] = numbers;
  if (width < 2 || height < 2 || width * height > kMostPixels || white < 1 || white > 65535) {
    refuse(std::to_string(width) + " × " + std::to_string(height) + " pixels up to " +
           std::to_string(white) + ", expected 2 × 2 at least, " + std::to_string(kMostPixels) +
           " at most, up to 65535");
  }
  file.get();
  std::vector<std::vector<long>> rows;
  for (long j = 0; j < height; ++j) {
    std::vector<long> row;
    for (long i = 0; i < width; ++i) {
      long value = 0;
      if (magic == "P2") {
        file >> value;
      } else {
        value = file.get();
        if (white > 255) value = 256 * value + file.get();
      }
      if (!file || value < 0 || value > white) refuse("pixels are missing, or brighter than white");
      row.push_back(value);
    }
    rows.insert(rows.begin(), row);
  }
  YAML::Node node(rows);
  node.SetStyle(YAML::EmitterStyle::Flow);
  YAML::Node result;
  result["heights"] = node;
  result["white"] = white;
  return result;
}

/// A height_map whose image is read: `low` [m] is black, `high` white.
YAML::Node TakeImage(const std::string& name, const YAML::Node& surface,
                     const std::string& folder) {
  MapReader reader(surface, "terrain/" + name);
  std::string file;
  double low = 0, high = 1;
  for (const char* key : {"high", "step"}) reader.Require(key);
  reader.Read("image", &file);
  reader.Read("low", &low);
  reader.Read("high", &high);
  for (const char* key : {"heights", "height", "scale"}) {
    if (!reader.Has(key)) continue;
    throw std::invalid_argument("terrain/" + name + "/" + key +
                                " is given beside an image: take one of them out" +
                                reader.Line(key));
  }
  YAML::Node taken(YAML::NodeType::Map);
  for (const auto& entry : surface) {
    const std::string key = entry.first.Scalar();
    if (key != "image" && key != "low" && key != "high") taken[key] = entry.second;
  }
  try {
    const YAML::Node image = ReadImage(file.substr(0, 1) == "/" ? file : folder + file);
    taken["heights"] = image["heights"];
    taken["height"] = low;
    taken["scale"] = (high - low) / image["white"].as<double>();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("terrain/" + name + ": " + error.what() + reader.Line("image"));
  }
  return taken;
}

/// Throws for a surface that contacts cannot be made with.
void CheckSurface(const std::string& name, const YAML::Node& surface) {
  MapReader reader(surface, "terrain/" + name);
  std::string kind;
  reader.Require("kind");
  reader.Read("kind", &kind);
  if (kind == "mesh") {
    throw std::invalid_argument("terrain/" + name +
                                "/kind 'mesh' has edges, where the distance "
                                "has no derivative: take boxes, stairs or a height_map, or a "
                                "link_plane with link: world for a corner below a face" +
                                reader.Line("kind"));
  }
  int index = 0;
  reader.Read("kind", {"plane", "box", "height_field", "height_map", "stairs"}, &index);
  for (const char* key : {"link", "point", "radius", "axis"}) {
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
    std::string text;
    try {
      text = ReadTextFile(path, kMaxTerrainBytes);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("terrain: " + std::string(error.what()) + " (line " +
                                  std::to_string(value.Mark().line + 1) + ")");
    }
    try {
      const YAML::Node read = ParseYamlDocument(text);
      if (!read.IsMap()) throw std::invalid_argument("it is not a map of names to surfaces");
      return ReadTerrain(read, folder);
    } catch (const YAML::Exception& error) {
      throw std::invalid_argument("terrain: " + path + ": " + error.what());
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("terrain: " + path + ": " + error.what());
    }
  }
  MapReader reader(value, "terrain");
  if (reader.Keys().empty()) {
    throw std::invalid_argument(
        "terrain holds no surface: name one, as floor: {kind: plane}, or "
        "take the terrain out, for contacts with the plane z = 0" +
        reader.Line(""));
  }
  YAML::Node terrain(YAML::NodeType::Map);
  for (const std::string& name : reader.Keys()) {
    const YAML::Node surface = reader.Child(name);
    CheckSurface(name, surface);
    terrain[name] = surface["image"] ? TakeImage(name, surface, folder) : surface;
  }
  return terrain;
}

}  // namespace contact_flow
