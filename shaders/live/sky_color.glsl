// The world's radiance in a direction, of an equirectangular picture as Cycles maps it (see World).
vec3 sky_color(vec3 direction)
{
  vec3 d = normalize(direction);
  vec2 at = vec2(0.5 - atan(d.y, d.x) / 6.2831853, 1.0 - acos(clamp(d.z, -1.0, 1.0)) / 3.14159265);
  vec2 size = vec2(textureSize(sky, 0)), p = at * size - 0.5;
  ivec2 corner = ivec2(floor(p)), n = ivec2(size);
  vec2 f = p - floor(p);
  vec3 sum = vec3(0.0);
  for (int i = 0; i < 4; i++) {
    ivec2 o = ivec2(i & 1, i >> 1), texel = corner + o;
    texel = ivec2((texel.x % n.x + n.x) % n.x, clamp(texel.y, 0, n.y - 1));
    vec2 w = mix(1.0 - f, f, vec2(o));
    sum += w.x * w.y * texelFetch(sky, texel, 0).rgb;
  }
  return sum;
}
