// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/io/mesh_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "contact_flow/io/text_file.h"

#if CONTACT_FLOW_HAVE_ASSIMP
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#endif

namespace contact_flow {
namespace {

using Vertices = std::vector<Vec3<double>>;

constexpr std::size_t kMaxMeshBytes = 256u << 20;

bool IsFile(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

bool StartsWith(const std::string& text, const char* prefix) {
  return text.compare(0, std::strlen(prefix), prefix) == 0;
}

/// "/a/b/" from "/a/b/c/"; "" when there is nothing above.
std::string Above(const std::string& folder) {
  if (folder.size() < 2) return "";
  const std::size_t slash = folder.rfind('/', folder.size() - 2);
  return slash == std::string::npos ? "" : folder.substr(0, slash + 1);
}

/// Whether the package.xml of this folder, if it has one, gives it this name: a clone may lie in a
/// folder of another one.
bool NamesPackage(const std::string& folder, const std::string& package) {
  constexpr std::size_t kLongest = 1 << 16;
  const std::string file = folder + "package.xml";
  if (!IsFile(file) || ::access(file.c_str(), R_OK) != 0) return false;
  const std::string text = ReadTextFile(file, kLongest);
  const std::string begin = "<name>", space = " \t\r\n";
  const std::size_t at = text.find(begin), end = text.find("</name>");
  if (at == std::string::npos || end == std::string::npos || end < at) return false;
  const std::string name = text.substr(at + begin.size(), end - at - begin.size());
  const std::size_t first = name.find_first_not_of(space), last = name.find_last_not_of(space);
  return first != std::string::npos && name.substr(first, last - first + 1) == package;
}

/// Header of 80 bytes, number of triangles, 50 bytes each: normal, three corners, attribute.
bool ReadBinaryStl(const std::string& bytes, Vertices* vertices) {
  std::uint32_t count = 0;
  if (bytes.size() < 84) return false;
  std::memcpy(&count, bytes.data() + 80, 4);
  if (bytes.size() < 84 + 50 * static_cast<std::size_t>(count)) return false;
  if (StartsWith(bytes, "solid") && bytes.size() != 84 + 50 * static_cast<std::size_t>(count)) {
    return false;
  }
  for (std::uint32_t k = 0; k < 3 * count; ++k) {
    float numbers[3];
    std::memcpy(numbers, bytes.data() + 84 + 50 * (k / 3) + 12 + 12 * (k % 3), 12);
    vertices->emplace_back(numbers[0], numbers[1], numbers[2]);
  }
  return true;
}

/// Lines that begin with `word` and three numbers: corners of a text STL ("vertex") or OBJ ("v").
void ReadLines(const std::string& text, const std::string& word, Vertices* vertices) {
  std::istringstream lines(text);
  std::string line, first;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    double x, y, z;
    if (words >> first && first == word && words >> x >> y >> z) vertices->emplace_back(x, y, z);
  }
}

#if CONTACT_FLOW_HAVE_ASSIMP
void AddNode(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent,
             Vertices* vertices) {
  const aiMatrix4x4 pose = parent * node.mTransformation;
  for (unsigned k = 0; k < node.mNumMeshes; ++k) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[k]];
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D p = pose * mesh.mVertices[i];
      vertices->emplace_back(p.x, p.y, p.z);
    }
  }
  for (unsigned k = 0; k < node.mNumChildren; ++k) {
    AddNode(scene, *node.mChildren[k], pose, vertices);
  }
}

void ReadByAssimp(const std::string& path, Vertices* vertices) {
  Assimp::Importer importer;
  // As rviz does: the axes of the file are those of the link, whatever it calls "up".
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFile(path, 0);
  if (!scene || !scene->mRootNode) {
    throw std::invalid_argument(path + ": " + importer.GetErrorString());
  }
  AddNode(*scene, *scene->mRootNode, aiMatrix4x4(), vertices);
}
#endif

}  // namespace

std::string FindMesh(const std::string& name, const std::string& folder) {
  std::string file = name;
  if (StartsWith(name, "file://")) file = name.substr(7);
  const bool packaged = StartsWith(name, "package://") || StartsWith(name, "model://");
  if (!packaged) {
    if (!StartsWith(file, "/")) file = folder + file;
    return IsFile(file) ? file : "";
  }
  file = name.substr(name.find("://") + 3);
  const std::size_t slash = file.find('/');
  if (slash == std::string::npos) return "";
  const std::string package = file.substr(0, slash), rest = file.substr(slash + 1);
  std::vector<std::string> roots;
  for (std::string at = folder; !at.empty(); at = Above(at)) roots.push_back(at);
  if (const char* path = std::getenv("ROS_PACKAGE_PATH")) {
    std::istringstream list(path);
    for (std::string part; std::getline(list, part, ':');) {
      if (!part.empty()) roots.push_back(part.back() == '/' ? part : part + "/");
    }
  }
  for (const std::string& root : roots) {
    if (IsFile(root + file)) return root + file;
    const std::size_t end = root.size() - 1;
    const std::size_t begin = root.rfind('/', end - 1) + 1;
    const bool named = root.substr(begin, end - begin) == package || NamesPackage(root, package);
    if (named && IsFile(root + rest)) return root + rest;
  }
  return "";
}

std::vector<Vec3<double>> ReadMeshVertices(const std::string& path) {
  std::string ending = path.substr(path.rfind('.') + 1);
  for (char& letter : ending) letter = static_cast<char>(std::tolower(letter));
  Vertices vertices;
  if (ending == "stl" || ending == "obj") {
    const std::string bytes = ReadTextFile(path, kMaxMeshBytes);
    if (bytes.size() > kMaxMeshBytes) throw std::invalid_argument(path + ": larger than 256 MB");
    if (ending == "obj") {
      ReadLines(bytes, "v", &vertices);
    } else if (!ReadBinaryStl(bytes, &vertices)) {
      ReadLines(bytes, "vertex", &vertices);
    }
  } else {
#if CONTACT_FLOW_HAVE_ASSIMP
    ReadByAssimp(path, &vertices);
#else
    throw std::invalid_argument(path + ": only STL and OBJ are read: this build has no assimp");
#endif
  }
  for (const Vec3<double>& vertex : vertices) {
    if (!vertex.allFinite()) throw std::invalid_argument(path + ": a vertex is not finite");
  }
  if (vertices.empty()) throw std::invalid_argument(path + ": there are no vertices");
  return vertices;
}

}  // namespace contact_flow
