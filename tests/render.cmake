polypic_test(render_sampling LABEL fast LINK polypic_render)
polypic_test(render_light LABEL fast LINK polypic_render)
polypic_test(render_images LABEL fast LINK polypic_render OpenImageIO::OpenImageIO)
polypic_test(render_flat LABEL fast LINK polypic_render)
