// Surfaces in world space, with the light at their vertices.
// In: position, uv, and as numbers the row of the light, the object and the material: whole.
// lights: direct and indirect light by turns. objects: three rows of each object's matrix from where
// `position` has it to where it is, and a row whose x says whether the view shows it. Tables are `row_of`'s.
// nearer, a factor of clip space and what is added to its z, moves all a little towards the eye, so that it covers what Solid shading drew of it.
ivec2 row_of(int row)
{
  return ivec2(row % 4096, row / 4096);
}

void main()
{
  int light = 2 * int(whole.x + 0.5), object = 4 * int(whole.y + 0.5);
  vec4 at = vec4(position, 1.0);
  vec3 moved = vec3(dot(texelFetch(objects, row_of(object), 0), at),
                    dot(texelFetch(objects, row_of(object + 1), 0), at),
                    dot(texelFetch(objects, row_of(object + 2), 0), at));
  bool shown = texelFetch(objects, row_of(object + 3), 0).x > 0.5;
  direct_at = texelFetch(lights, row_of(light), 0).rgb;
  indirect_at = texelFetch(lights, row_of(light + 1), 0).rgb;
  uv_at = uv;
  toward_at = moved - eye.xyz * eye.w;
  material_at = int(whole.z + 0.5);
  vec4 clip = view_projection * vec4(moved, 1.0);
  gl_Position = shown ? clip * nearer.x + vec4(0.0, 0.0, nearer.y, 0.0) : vec4(0.0, 0.0, 2.0, 1.0);
}
