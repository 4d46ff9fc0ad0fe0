// Tables of materials. materials: three rows each: base color and its image, emission and its image, opacity and its
// image, −1 for none. images: first texel, width, height, and whether it extends its edges. pixels: all images with
// their halved copies after each, from the bottom left.
ivec2 row_of(int row)
{
  return ivec2(row % 4096, row / 4096);
}

int wrapped(int i, int n, bool extends)
{
  return extends ? clamp(i, 0, n - 1) : (i % n + n) % n;
}

vec4 texel_of(int first, ivec2 size, ivec2 at, bool extends)
{
  return texelFetch(pixels, row_of(first + wrapped(at.y, size.y, extends) * size.x + wrapped(at.x, size.x, extends)), 0);
}

vec3 image_at(int image, vec2 uv, vec2 uv_dx, vec2 uv_dy)
{
  vec4 said = texelFetch(images, row_of(image), 0);
  int first = int(said.x + 0.5);
  ivec2 size = ivec2(said.yz + 0.5);
  bool extends = said.w > 0.5;
  vec2 step_x = uv_dx * vec2(size), step_y = uv_dy * vec2(size);
  float footprint = max(dot(step_x, step_x), dot(step_y, step_y));
  for (int level = int(0.5 * log2(max(footprint, 1.0)) + 0.5); level > 0 && (size.x > 1 || size.y > 1); level--) {
    first += size.x * size.y;
    size = max(size / 2, ivec2(1));
  }
  vec2 p = (extends ? clamp(uv, 0.0, 1.0) : fract(uv)) * vec2(size) - 0.5;
  ivec2 at = ivec2(floor(p));
  vec2 f = p - floor(p);
  vec4 low = mix(texel_of(first, size, at, extends), texel_of(first, size, at + ivec2(1, 0), extends), f.x);
  vec4 high = mix(texel_of(first, size, at + ivec2(0, 1), extends), texel_of(first, size, at + ivec2(1), extends), f.x);
  return mix(low, high, f.y).rgb;
}

vec3 of_material(int row, vec2 uv, vec2 uv_dx, vec2 uv_dy)
{
  vec4 said = texelFetch(materials, row_of(row), 0);
  return said.w < -0.5 ? said.rgb : said.rgb * image_at(int(said.w + 0.5), uv, uv_dx, uv_dy);
}

// Whether a surface of an opacity is there at this pixel: as many pixels of 4 x 4 show it as light does not pass.
bool shows(float opacity)
{
  ivec2 p = ivec2(gl_FragCoord.xy) & 3;
  int order = ((p.x ^ p.y) & 1) * 8 + (p.y & 1) * 4 + (((p.x ^ p.y) >> 1) & 1) * 2 + ((p.y >> 1) & 1);
  return opacity * 16.0 > float(order) + 0.5;
}
