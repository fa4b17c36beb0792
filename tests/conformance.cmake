# What each screen-space method makes of scenes whose truth is known; writes docs/conformance.md.
set(conformance conformance)
cranny_test(conformance LAYERS screen LABELS slow TIMEOUT 300 SOURCES
    ${conformance}/scenes.c ${conformance}/forms.c ${conformance}/same.c ${conformance}/depths.c
    ${conformance}/samples.c ${conformance}/noise.c ${conformance}/page.c)
