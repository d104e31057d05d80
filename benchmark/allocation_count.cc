// SPDX-License-Identifier: BSD-3-Clause
//
// Puts a counter in front of glibc's allocator. The benchmark has one thread.
#include "allocation_count.h"

#include <cerrno>
#include <cstddef>
#include <cstdlib>

#ifdef __GLIBC__

static long allocation_count = 0;

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++allocation_count;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  ++allocation_count;
  return __libc_calloc(count, size);
}

void* realloc(void* pointer, std::size_t size) {
  ++allocation_count;
  return __libc_realloc(pointer, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  ++allocation_count;
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }

int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
  *pointer = memalign(alignment, size);
  return *pointer != nullptr ? 0 : ENOMEM;
}

}  // extern "C"

#endif

namespace contact_flow {
namespace benchmark {

long AllocationCount() {
#ifdef __GLIBC__
  return allocation_count;
#else
  return -1;
#endif
}

}  // namespace benchmark
}  // namespace contact_flow
