// A triangle over the whole view, as far away as can be. In: corner (clip space), toward (world direction there).
void main()
{
  toward_at = toward;
  gl_Position = vec4(corner, 1.0, 1.0);
}
